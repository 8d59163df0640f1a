//! `parallax detect`: people in single images.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use fmp::{CandidateSettings, Layout, Pose, Precision};
use footage::{ACCENT, Canvas, FAINT, Size, Source, SourceSpec};
use kernels::Rgb8View;
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::json;
use skeleton::JointSet;

use crate::describe::{self, Placed};
use crate::search::Search;
use crate::sheet::{Sheet, Skeleton, limbs};
use crate::{inputs, output};

/// Which images, and how.
#[derive(Debug, Args)]
#[command(after_help = "\
With --json one line per image, best detection first:
    {\"image\", \"width\", \"height\", \"detections\": [{\"score\", \"level\", \"scale\",
     \"parts\": [{\"x\", \"y\", \"type\", \"box\": [x1, y1, x2, y2]}], \"joints\": {name: [x, y]}}]}
Pixels of the image, the centre of its top-left pixel is (0, 0); types and levels count from 1.

Examples:
    parallax detect photo.jpg
    parallax detect folder/ --model parse.mat --threshold -0.5 --json > people.jsonl
    parallax detect *.png --overlay drawn/
    parallax detect folder/ --sheet sheet.png")]
pub(crate) struct Arguments {
    /// Images, or folders of images.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// The model file; the person model that ships with Parallax if not given.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Lowest score of a detection; the trained threshold, but at most -1, if not given.
    #[arg(long, value_name = "SCORE", allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Largest share of a better detection's boxes that a worse one may cover.
    #[arg(long, value_name = "SHARE", default_value_t = 0.1)]
    overlap: f64,
    /// Most detections of an image.
    #[arg(long, value_name = "N", default_value_t = 100)]
    max: usize,
    /// Print one line of JSON per image.
    #[arg(long)]
    json: bool,
    /// Draw the detections into this folder, as PNG.
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Draw thumbnails with the best detection of every image into this file, as PNG; more than 40 images make
    /// several files, numbered before the ending.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Joints: parse14, umpm15 or humaneva20.
    #[arg(long, value_name = "NAME", default_value = "parse14", value_parser = describe::joint_set)]
    joints: &'static JointSet,
    /// How exactly the filters are evaluated: f32, or bf16, which is faster, moves scores by some thousandths
    /// and needs a processor with AMX.
    #[arg(long, value_name = "NAME", default_value = "f32", value_parser = precision)]
    precision: Precision,
}

/// A precision that this machine has.
fn precision(name: &str) -> Result<Precision, String> {
    let precision = match name {
        "f32" => Precision::F32,
        "bf16" => Precision::Bf16,
        _ => return Err("expected f32 or bf16".to_owned()),
    };
    let fits = precision.check();
    fits.map_err(|why| format!("{why}; leave --precision out"))?;
    Ok(precision)
}

/// Detects.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let detector = Detector {
        settings: CandidateSettings {
            threshold: arguments.threshold.unwrap_or(model.detection_threshold()) as f32,
            overlap: arguments.overlap,
            max: arguments.max,
        },
        search: Search::in_precision(arguments.precision, model).or_fail(ExitKind::Usage)?,
    };
    if let Some(folder) = &arguments.overlay {
        inputs::make_folder(folder)?;
    }
    let images = inputs::images(&arguments.images)?;
    let mut sheet = arguments
        .sheet
        .as_ref()
        .map(|it| Sheet::new(it.clone(), images.len()));
    for image in &images {
        detector.one(image, arguments, sheet.as_mut())?;
    }
    if let Some(sheet) = sheet {
        sheet.finish()?;
    }
    Ok(ExitCode::SUCCESS)
}

struct Detector {
    search: Search,
    settings: CandidateSettings,
}

impl Detector {
    fn one(
        &self,
        path: &Path,
        arguments: &Arguments,
        sheet: Option<&mut Sheet>,
    ) -> Result<(), Failure> {
        let spec = SourceSpec::new(path.to_string_lossy());
        let mut source = Source::open(&spec).or_fail(ExitKind::Input)?;
        let size = source.info().size;
        let frame = source.next_frame().or_fail(ExitKind::Input)?;
        let rgb = frame.map_or(&[][..], |it| it.rgb);
        let image = Rgb8View::new(size.width, size.height, rgb);
        let image = image.map_err(|error| inputs::in_file(path, &error))?;
        let layout = Layout::new(&self.search.model, size.width, size.height);
        let layout = layout.map_err(|error| inputs::in_file(path, &error))?;
        let found = self.detect(image, &layout);
        self.report(path, arguments, &layout, &found)?;
        if let Some(folder) = &arguments.overlay {
            let canvas = self.draw(size, rgb, &layout, &found);
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let file = folder.join(format!("{name}.png"));
            canvas.save_png(&file).or_fail(ExitKind::Input)?;
        }
        if let Some(sheet) = sheet {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let best = found.first().map(|pose| Skeleton {
                points: pose.centres(&self.search.model, &layout),
                limbs: limbs(&self.search.model),
                score: pose.score,
            });
            sheet.add(&name, size, rgb, best.as_ref())?;
        }
        Ok(())
    }

    fn report(
        &self,
        path: &Path,
        arguments: &Arguments,
        layout: &Layout,
        found: &[Pose],
    ) -> Result<(), Failure> {
        if arguments.json {
            let detections: Vec<_> = found
                .iter()
                .map(|pose| {
                    Placed::new(pose, &self.search.model, layout).json(Some(arguments.joints))
                })
                .collect();
            output::json(&json!({
                "image": path,
                "width": layout.image_size[0],
                "height": layout.image_size[1],
                "detections": detections,
            }))?;
        } else {
            output::line(format_args!(
                "{}: {} detections",
                path.display(),
                found.len()
            ))?;
            for pose in found {
                let [x, y] = pose.centre(&self.search.model, layout, 0);
                output::line(format_args!(
                    "  score {:8.4}  level {:2}  head at ({x:.1}, {y:.1})",
                    pose.score,
                    pose.level + 1
                ))?;
            }
        }
        Ok(())
    }

    fn detect(&self, image: Rgb8View<'_>, layout: &Layout) -> Vec<Pose> {
        let Self { search, settings } = self;
        search.on(image, layout, |it| search.solver.candidates(it, settings))
    }

    /// The best detection in colour, the others faint.
    fn draw(&self, size: Size, rgb: &[u8], layout: &Layout, found: &[Pose]) -> Canvas {
        let mut canvas = Canvas::from_rgb(size, rgb);
        for (rank, pose) in found.iter().enumerate().rev() {
            let colour = if rank == 0 { ACCENT } else { FAINT };
            let centres = pose.centres(&self.search.model, layout);
            for (part, spec) in self.search.model.spec().parts.iter().enumerate() {
                if let Some(edge) = &spec.edge {
                    canvas.line(centres[edge.parent], centres[part], 1.5, colour);
                }
            }
            let [x, y] = centres[0];
            canvas.text([x + 6.0, y], &format!("{:.2}", pose.score), colour);
        }
        canvas
    }
}
