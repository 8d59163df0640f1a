//! The shipped model on people it was not trained on.

use std::sync::Arc;

use datasets::{Person, Picture, ReadOptions, Selection};
use evaluation::{PcpRule, evaluate};
use fmp::{Extractor, Layout, Responses, Solver};
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
