//! Finds people with a network that detects keypoints in boxes. The user gives the boxes, or a detector finds them.

use std::path::PathBuf;

use failure::{ExitKind, Failure, OrFail as _};
use footage::{ACCENT, Canvas, draw_limbs, line_width};
use inputs::pictures::Picture;
use inputs::sheet::{Sheet, Skeleton};
use inputs::{detector, network};
use posenetwork::{
    Detector as BoxDetector, JointMaps, LookMemory, MapSettings, PoseNetwork, Turn, Workspace,
    overlap,
};
use serde_json::{Map, Value, json};
use skeleton::PARSE14;
use terminal::output;

use super::Detector;
use inputs::network::keypoints_json;

/// Boxes that overlap by more than this fraction belong to the same person.
const SAME: f64 = 0.5;

/// The network that finds keypoints, and the detector of the boxes.
pub(super) struct Eyes {
    /// The network's file, as named on the command line.
    pub(super) file: PathBuf,
    pub(super) network: PoseNetwork,
    pub(super) detector: BoxDetector,
    /// Minimum heat of a person in a box of the detector, from 0 to 1.
    pub(super) least_heat: f64,
}

/// Origin of a box.
#[derive(Clone, Copy)]
enum From {
    /// The user gave the box.
    Given,
    /// The detector found the box.
    Detector,
}

/// A box in which the network looks for a person.
#[derive(Clone, Copy)]
struct Outline {
    /// Left, top, right and bottom side, in pixels of the picture.
    sides: [f64; 4],
    /// Score by the detector, if the detector found the box.
    score: Option<f64>,
}

/// A person in a box.
struct Person {
    outline: Outline,
    keypoints: Vec<Value>,
    /// Joints by their numbers in `skeleton::PARSE14`, in pixels of the picture. A joint that the keypoints do not determine is not finite.
    joints: Vec<[f64; 2]>,
    score: f64,
}

impl Detector<'_> {
    /// Finds the people in a picture, and reports them.
    ///
    /// # Errors
    ///
    /// An inner error concerns only this picture. An outer error ends the command.
    pub(super) fn look(
        &self,
        eyes: &Eyes,
        picture: &Picture,
        sheet: Option<&mut Sheet>,
    ) -> Result<Result<(), Failure>, Failure> {
        let (found, from) = match self.people(eyes, picture) {
            Ok(found) => found,
            Err(failure) => return Ok(Err(failure)),
        };
        self.report_people(picture, (eyes, from), &found)?;
        self.draw_people(picture, &found)?;
        if let Some(sheet) = sheet {
            let best = found.first().map(Person::skeleton);
            sheet.add(&picture.title(), picture.size, &picture.rgb, best.as_ref())?;
        }
        Ok(Ok(()))
    }

    /// Returns the people in the given box or in the detector's boxes, each person once. The person with the highest score comes first.
    fn people(&self, eyes: &Eyes, picture: &Picture) -> Result<(Vec<Person>, From), Failure> {
        let mut memory = LookMemory::default();
        if let Some(outline) = self.arguments.outline {
            let outline = Outline {
                sides: outline.0,
                score: None,
            };
            let person = Person::seen(&eyes.network, picture, outline, memory.workspace())?;
            return Ok((vec![person], From::Given));
        }
        let mut found = detector::people(&eyes.detector, picture, &mut Vec::new())?;
        found.truncate(self.arguments.max);
        let is_alone = found.len() == 1;
        let people = found.into_iter().map(|found| {
            let outline = Outline {
                sides: found.outline,
                score: Some(found.score),
            };
            if is_alone {
                Person::seen_closer(eyes, picture, outline, &mut memory)
            } else {
                Person::seen(&eyes.network, picture, outline, memory.workspace())
            }
        });
        let mut people = people.collect::<Result<Vec<Person>, Failure>>()?;
        people.retain(|person| person.score >= eyes.least_heat);
        people.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut apart: Vec<Person> = Vec::with_capacity(people.len());
        for person in people {
            let is_same =
                |other: &Person| overlap(other.outline.sides, person.outline.sides) > SAME;
            if !apart.iter().any(is_same) {
                apart.push(person);
            }
        }
        Ok((apart, From::Detector))
    }

    fn report_people(
        &self,
        picture: &Picture,
        (eyes, from): (&Eyes, From),
        found: &[Person],
    ) -> Result<(), Failure> {
        if found.is_empty() {
            output::message(format_args!("{}: {}", picture.title(), nobody(eyes)));
        }
        if self.arguments.json {
            return self.report_json(picture, (eyes, from), found);
        }
        let how = match from {
            From::Detector => format!("boxes by {}", eyes.detector.card().name),
            From::Given => "box given".to_owned(),
        };
        let turned = if picture.turn.is_none() {
            String::new()
        } else {
            format!("; {}", picture.turn)
        };
        let n = found.len();
        let detections = if n == 1 { "detection" } else { "detections" };
        let frame = picture.frame.map_or(String::new(), |frame| format!(" frame {frame}"));
        output::line(format_args!(
            "{}{frame}: {n} {detections} by the network; {how}{turned}",
            picture.path.display()
        ))?;
        for person in found {
            let [x1, y1, x2, y2] = person.outline.sides;
            let score = person.outline.score;
            let sure = score.map_or(String::new(), |score| format!(" of score {score:.2}"));
            let [x, y] = person.joints.last().copied().unwrap_or([f64::NAN; 2]);
            output::line(format_args!(
                "  score {:5.2}  box ({x1:.0}, {y1:.0}) to ({x2:.0}, {y2:.0}){sure}  head at ({x:.1}, {y:.1})",
                person.score
            ))?;
        }
        Ok(())
    }

    fn report_json(
        &self,
        picture: &Picture,
        (eyes, from): (&Eyes, From),
        found: &[Person],
    ) -> Result<(), Failure> {
        let from = match from {
            From::Given => "given",
            From::Detector => "detector",
        };
        let detections: Vec<Value> = found.iter().map(|person| person.json(from)).collect();
        let mut line = json!({
            "image": picture.path,
            "width": picture.size.width,
            "height": picture.size.height,
            "network": eyes.file,
            "detections": detections,
        });
        if let Some(detector) = &self.arguments.detector {
            line["detector"] = json!(detector);
        }
        if let Some(frame) = picture.frame {
            line["frame"] = json!(frame);
        }
        output::json(&line)
    }

    fn draw_people(&self, picture: &Picture, found: &[Person]) -> Result<(), Failure> {
        let Some(folder) = &self.arguments.overlay else {
            return Ok(());
        };
        let mut canvas = Canvas::from_rgb(picture.size, &picture.rgb);
        for person in found.iter().rev() {
            canvas.frame(person.outline.sides, 0.5 * line_width(picture.size), ACCENT);
            let skeleton = person.skeleton();
            draw_limbs(&mut canvas, &skeleton.points, &skeleton.limbs);
            let [x, y, ..] = person.outline.sides;
            canvas.label([x + 4.0, y + 4.0], &format!("{:.2}", person.score), ACCENT);
        }
        let file = folder.join(format!("{}.png", picture.stem()));
        canvas.save_png(&file).or_fail(ExitKind::Input)
    }
}

impl Person {
    /// If there is only one box, replaces it by a box that fits the person better, as a deployment does.
    fn seen_closer(
        eyes: &Eyes,
        picture: &Picture,
        outline: Outline,
        memory: &mut LookMemory,
    ) -> Result<Self, Failure> {
        let network = &eyes.network;
        let (sides, turn) = network::closest(network, picture, outline.sides, memory)?;
        let closer = Outline { sides, ..outline };
        let (person, _) = Self::turned(network, picture, (closer, turn), memory.workspace())?;
        Ok(person)
    }

    /// Looks at the person. If the person is lying or upside down, also looks at the rotated picture, and returns the result with the
    /// better score.
    fn seen(
        network: &PoseNetwork,
        picture: &Picture,
        outline: Outline,
        workspace: &mut Workspace,
    ) -> Result<Self, Failure> {
        let (first, turn) = Self::turned(network, picture, (outline, Turn::Up), workspace)?;
        if turn == Turn::Up || !network.may_turn() {
            return Ok(first);
        }
        let (turned, _) = Self::turned(network, picture, (outline, turn), workspace)?;
        Ok(if turned.score > first.score {
            turned
        } else {
            first
        })
    }

    /// Finds the person in the picture, rotated by `turn`. Also returns how the picture should be rotated.
    fn turned(
        network: &PoseNetwork,
        picture: &Picture,
        (outline, turn): (Outline, Turn),
        workspace: &mut Workspace,
    ) -> Result<(Self, Turn), Failure> {
        let sight = network::look(network, picture, (outline.sides, turn), workspace)?;
        let mut maps = JointMaps::default();
        let settings = MapSettings::default();
        maps.read(&sight, &settings).or_fail(ExitKind::Input)?;
        let next = maps.turn(turn);
        maps.name_sides(network, sight.front());
        let scores: Vec<f64> = maps.peaks().iter().flatten().map(|peak| peak.score).collect();
        let joints = maps.peaks().iter();
        let person = Self {
            outline,
            keypoints: keypoints_json(&sight)?,
            joints: joints.map(|joint| joint.map_or([f64::NAN; 2], |place| place.at)).collect(),
            score: scores.iter().sum::<f64>() / scores.len().max(1) as f64,
        };
        Ok((person, next))
    }

    fn skeleton(&self) -> Skeleton {
        Skeleton {
            points: self.joints.clone(),
            limbs: network::limbs(),
            score: self.score as f32,
        }
    }

    fn json(&self, from: &str) -> Value {
        let named = PARSE14.joints.iter().zip(&self.joints);
        let joints = named.map(|(joint, at)| {
            let at = at.iter().all(|value| value.is_finite()).then_some(at);
            (joint.name.to_owned(), json!(at))
        });
        let mut value = json!({
            "score": self.score,
            "box": self.outline.sides,
            "box_from": from,
            "keypoints": self.keypoints,
            "joints": joints.collect::<Map<_, _>>(),
        });
        if let Some(score) = self.outline.score {
            value["box_score"] = json!(score);
        }
        value
    }
}

/// Explains why nobody was found.
fn nobody(eyes: &Eyes) -> String {
    let card = eyes.detector.card();
    format!(
        "the detector {} finds nobody (no box reaches `least_score` = {} of its card), or the network finds nobody with a heat of at least \
         {}; use --box to give a box",
        card.name, card.least_score, eyes.least_heat
    )
}
