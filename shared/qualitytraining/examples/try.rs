//! Tries trainings.
#![allow(clippy::all, clippy::pedantic, clippy::unwrap_used, clippy::print_stdout)]
use qualitytraining::sample::Sample;
use qualitytraining::settings::Settings;
use qualitytraining::store::Samples;
use qualitytraining::trainer::Trainer;
use qualitytraining::network::Kind;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut settings = Settings::default();
    let mut train = Samples::default();
    let mut test: Vec<(String, Samples)> = Vec::new();
    let mut out = None;
    let read = |p: &str| Samples::from_bytes(&std::fs::read(p).unwrap()).unwrap();
    for a in &args {
        let (k, v) = a.split_once('=').unwrap();
        match k {
            "train" => { let s = read(v); train.tile = s.tile; train.all.extend(s.all); }
            "test" => test.push((v.to_owned(), read(v))),
            "out" => out = Some(v.to_owned()),
            "network" => settings.network = match v { "evidence" => Kind::Evidence, "vgg16" => Kind::Vgg16, _ => Kind::Small },
            "epochs" => settings.epochs = v.parse().unwrap(),
            "patience" => settings.patience = v.parse().unwrap(),
            "rate" => settings.rate = v.parse().unwrap(),
            "decay" => settings.decay = v.parse().unwrap(),
            "dropout" => settings.dropout = v.parse().unwrap(),
            "hidden" => settings.hidden = v.parse().unwrap(),
            "width" => settings.width = v.parse().unwrap(),
            "batch" => settings.batch = v.parse().unwrap(),
            "mirror" => settings.vary.mirror = v.parse().unwrap(),
            "seed" => settings.seed = v.parse().unwrap(),
            "loss" => settings.loss = if v == "l2" { qualitytraining::settings::Loss::L2 } else { qualitytraining::settings::Loss::Robust },
            "unit" => settings.unit = if v == "relative" { qualitytraining::settings::Unit::Relative } else { qualitytraining::settings::Unit::LogRelative },
            _ => panic!("{k}"),
        }
    }
    let mut trainer = Trainer::new(&settings, &train, &[], None).unwrap();
    println!("{:?} samples", trainer.n_samples());
    let t = std::time::Instant::now();
    while !trainer.is_done() {
        trainer.pass(&mut |_, _| true);
        let p = trainer.passes().last().unwrap();
        println!("{:3} {:.4} {:.4} {:.4}  {:.1}s", trainer.passes().len(), p.learnt, p.validated, p.area, t.elapsed().as_secs_f32());
    }
    println!("best {:?}", trainer.best());
    for (name, set) in &test {
        let all: Vec<&Sample> = set.all.iter().collect();
        let j = trainer.judge(&all);
        println!("{name}: n {} area {:.4} spearman {:.4} mean inaccuracy {:.4}", j.n, j.mean_area(), j.mean_rank_correlation(), j.inaccuracy.iter().sum::<f64>() / 26.0);
        println!("   {:?}", j.area.iter().map(|a| (a.unwrap_or(0.5)*100.0).round() as i32).collect::<Vec<_>>());
    }
    if let Some(out) = out { std::fs::write(out, trainer.onnx("try")).unwrap(); }
}
