//! The model and the network that ship on people they were not trained on.

use std::sync::Arc;

use datasets::{Person, Picture, ReadOptions, Selection};
use evaluation::{PcpRule, evaluate};
use fmp::{Extractor, Layout, Model, Responses, Solver};
use offline::network::NetworkFile;
use posenetwork::{JointMaps, LookMemory, Looker, MapSettings, outline_of, overlap};
use rayon::prelude::*;
use skeleton::PARSE14;

use crate::shared_dir;

type Joints = [[f64; 2]; 14];

#[test]
fn the_shipped_model_has_the_accuracy_of_its_card() {
    let Some(shared) = shared_dir() else { return };
    let file =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/models/person.fmp");
    let model = Arc::new(fmp::files::read(&file).unwrap());
    let extractor = Extractor::new(Arc::clone(&model));
    let solver = Solver::new(Arc::clone(&model));
    let options = ReadOptions {
        only: Some(Selection::from_argument("101-200").unwrap()),
        ..ReadOptions::default()
    };
    let people = datasets::read(&shared.join("data/parse"), &options).unwrap();
    assert_eq!(people.people.len(), 100);
    let find = |person: &Person| {
        let picture = Picture::read(&person.image).unwrap();
        let size = picture.size();
        let layout = Layout::new(&model, size.width, size.height).unwrap();
        let mut values = vec![0.0; layout.n_responses()];
        extractor.responses(picture.view(), &layout, &mut values);
        let levels: Vec<u16> = (0..layout.levels.len() as u16).collect();
        let pose = solver
            .best(&Responses::new(&layout, &values, &levels), None)
            .unwrap();
        let found = PARSE14.from_parts(&pose.centres(&model, &layout));
        let truth = Joints::try_from(person.joints.clone()).unwrap();
        (Joints::try_from(found).unwrap(), truth)
    };
    let found: Vec<_> = people.people.par_iter().map(find).collect();
    let report = evaluate(found.iter().map(|(found, truth)| (Some(found), truth)));
    println!("{report}");
    let pcp = [PcpRule::MeanOfEnds, PcpRule::BothEnds].map(|it| report.pcp(it).percent());
    // Other image decoders may change single limbs.
    for (got, card) in pcp.into_iter().zip(CARD) {
        assert!((got - card).abs() <= 0.5, "PCP {got}, the card says {card}");
    }
}

/// PCP by mean of ends and by both ends, from `configs/models/person.md`.
const CARD: [f64; 2] = [73.3, 67.4];

#[test]
fn a_person_whose_box_is_cut_off_is_looked_at_again_in_a_better_one() {
    let Some(shared) = shared_dir() else { return };
    let models = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/models");
    let network = NetworkFile::open(&models.join("person.pose.onnx"), None).unwrap();
    let network = network.fitted().unwrap();
    let springs = std::fs::read(models.join("person.springs")).unwrap();
    let springs = fmp::files::own::decode(&springs).unwrap();
    let springs = Solver::new(Arc::new(Model::new(springs).unwrap()));
    let options = ReadOptions {
        only: Some(Selection::from_argument("101-130").unwrap()),
        ..ReadOptions::default()
    };
    let people = datasets::read(&shared.join("data/parse"), &options).unwrap();
    let mut memory = LookMemory::default();
    // The shares of the true boxes that the first and the last box cover, of every person.
    let mut shares = Vec::new();
    for person in &people.people {
        let picture = Picture::read(&person.image).unwrap();
        let size = picture.size();
        let layout = Layout::new(springs.model(), size.width, size.height).unwrap();
        let looker = Looker {
            network: &network,
            springs: &springs,
            layout: &layout,
            settings: &MapSettings::default(),
        };
        let truth = outline_of(person.joints.iter().copied()).unwrap();
        let [left, top, right, bottom] = truth;
        let upper = [left, top, right, top + 0.6 * (bottom - top)];
        let mut maps = JointMaps::default();
        let image = picture.view();
        let first = looker.look((image, upper), &mut memory, &mut maps).unwrap();
        let last = looker.look_closer((image, first.unwrap()), &mut memory, &mut maps);
        let last = last.unwrap();
        shares.push([upper, last.outline].map(|it| overlap(it, truth)));
    }
    let mean = |nth: usize| shares.iter().map(|it| it[nth]).sum::<f64>() / shares.len() as f64;
    println!(
        "boxes cut off cover {:.2} of the true ones, those after them {:.2}",
        mean(0),
        mean(1)
    );
    assert!(mean(1) > mean(0) + 0.1, "{shares:.2?}");
}
