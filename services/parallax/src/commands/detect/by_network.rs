//! People in boxes, by a network that finds keypoints.

use fmp::Pose;
use footage::{ACCENT, Canvas, draw_limbs, line_width};
use launch::output;
use offline::network;
use offline::pictures::{Picture, Searched};
use offline::sheet::{Sheet, Skeleton};
use posenetwork::{JointMaps, MapSettings, OF_FILTERS, PoseNetwork, Workspace, outline_of_parts};
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::{Map, Value, json};
use skeleton::PARSE14;

use super::Detector;
use crate::commands::network::keypoints_json;

/// Longest side of a picture in which the filters search for boxes, pixels.
pub(super) const SIZE: usize = 640;

/// A person in a box.
struct Person {
    outline: [f64; 4],
    keypoints: Vec<Value>,
    /// By number in `skeleton::PARSE14`, pixels of the picture; not finite where the keypoints do not tell it.
    joints: Vec<[f64; 2]>,
    score: f64,
}

impl Detector<'_> {
    /// Looks at the people of a picture, and reports them.
    ///
    /// # Errors
    ///
    /// As for the search: the inner one concerns the picture.
    pub(super) fn look(
        &self,
        network: &PoseNetwork,
        picture: &Picture,
        sheet: Option<&mut Sheet>,
    ) -> Result<Result<(), Failure>, Failure> {
        let (found, searched) = match self.people(network, picture) {
            Ok(found) => found,
            Err(failure) => return Ok(Err(failure)),
        };
        self.report_people(picture, searched, &found)?;
        self.draw_people(picture, &found)?;
        if let Some(sheet) = sheet {
            let best = found.first().map(Person::skeleton);
            sheet.add(&picture.title(), picture.size, &picture.rgb, best.as_ref())?;
        }
        Ok(Ok(()))
    }

    /// The people, the best first, and the size of what the filters searched, if they did.
    fn people(
        &self,
        network: &PoseNetwork,
        picture: &Picture,
    ) -> Result<(Vec<Person>, Option<[usize; 2]>), Failure> {
        let (outlines, searched) = if let Some(outline) = self.arguments.outline {
            (vec![outline.0], None)
        } else {
            let searched = Searched::new(picture, self.arguments.longest(), &self.search)?;
            let found = self.detect(searched.image(picture)?, searched.layout());
            let outlines = found.iter().map(|it| self.outline(&searched, it));
            (outlines.collect(), Some(searched.layout().image_size))
        };
        let mut workspace = Workspace::default();
        let people: Result<Vec<Person>, Failure> = outlines
            .into_iter()
            .map(|it| Person::seen(network, picture, it, &mut workspace))
            .collect();
        Ok((people?, searched))
    }

    /// The box of a pose: all boxes of its parts, widened; pixels of the picture.
    fn outline(&self, searched: &Searched, pose: &Pose) -> [f64; 4] {
        let (model, layout) = (&self.search.model, searched.layout());
        let [left, top, right, bottom] = pose.bounding_box(model, layout);
        let (first, last) = (
            searched.in_picture([left, top]),
            searched.in_picture([right, bottom]),
        );
        outline_of_parts([first[0], first[1], last[0], last[1]])
    }

    fn report_people(
        &self,
        picture: &Picture,
        searched: Option<[usize; 2]>,
        found: &[Person],
    ) -> Result<(), Failure> {
        let from = if searched.is_some() {
            "filters"
        } else {
            "given"
        };
        if found.is_empty() {
            output::message(format_args!(
                "{}: the filters find nobody, so the network was not asked; --box says where to look",
                picture.title()
            ));
        }
        if self.arguments.json {
            let detections: Vec<Value> = found.iter().map(|it| it.json(from)).collect();
            let mut line = json!({
                "image": picture.path,
                "width": picture.size.width,
                "height": picture.size.height,
                "network": self.arguments.network,
                "searched": searched,
                "detections": detections,
            });
            if let Some(frame) = picture.frame {
                line["frame"] = json!(frame);
            }
            return output::json(&line);
        }
        let how = match searched {
            Some([width, height]) => format!(
                "boxes by the filters at {width}x{height} of {}, widened by {:.0} %",
                picture.size,
                100.0 * OF_FILTERS
            ),
            None => "box given".to_owned(),
        };
        let n = found.len();
        let detections = if n == 1 { "detection" } else { "detections" };
        let frame = picture
            .frame
            .map_or(String::new(), |it| format!(" frame {it}"));
        output::line(format_args!(
            "{}{frame}: {n} {detections} by the network; {how}",
            picture.path.display()
        ))?;
        for person in found {
            let [x1, y1, x2, y2] = person.outline;
            let [x, y] = person.joints.last().copied().unwrap_or([f64::NAN; 2]);
            output::line(format_args!(
                "  score {:5.2}  box ({x1:.0}, {y1:.0}) to ({x2:.0}, {y2:.0})  head at ({x:.1}, {y:.1})",
                person.score
            ))?;
        }
        Ok(())
    }

    fn draw_people(&self, picture: &Picture, found: &[Person]) -> Result<(), Failure> {
        let Some(folder) = &self.arguments.overlay else {
            return Ok(());
        };
        let mut canvas = Canvas::from_rgb(picture.size, &picture.rgb);
        for person in found.iter().rev() {
            canvas.frame(person.outline, 0.5 * line_width(picture.size), ACCENT);
            let skeleton = person.skeleton();
            draw_limbs(&mut canvas, &skeleton.points, &skeleton.limbs);
            let [x, y, ..] = person.outline;
            canvas.label([x + 4.0, y + 4.0], &format!("{:.2}", person.score), ACCENT);
        }
        let file = folder.join(format!("{}.png", picture.stem()));
        canvas.save_png(&file).or_fail(ExitKind::Input)
    }
}

impl Person {
    fn seen(
        network: &PoseNetwork,
        picture: &Picture,
        outline: [f64; 4],
        workspace: &mut Workspace,
    ) -> Result<Self, Failure> {
        let sight = network::look(network, picture, outline, workspace)?;
        let mut maps = JointMaps::default();
        let settings = MapSettings::default();
        maps.read(&sight, &settings).or_fail(ExitKind::Input)?;
        let scores: Vec<f64> = maps.peaks().iter().flatten().map(|it| it.score).collect();
        let joints = maps.peaks().iter();
        Ok(Self {
            outline,
            keypoints: keypoints_json(&sight)?,
            joints: joints
                .map(|it| it.map_or([f64::NAN; 2], |it| it.at))
                .collect(),
            score: scores.iter().sum::<f64>() / scores.len().max(1) as f64,
        })
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
            let at = at.iter().all(|it| it.is_finite()).then_some(at);
            (joint.name.to_owned(), json!(at))
        });
        json!({
            "score": self.score,
            "box": self.outline,
            "box_from": from,
            "keypoints": self.keypoints,
            "joints": joints.collect::<Map<_, _>>(),
        })
    }
}
