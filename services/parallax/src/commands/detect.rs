//! `parallax detect`: finds people in single images.

mod by_network;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::{CandidateSettings, Layout, Pose, Search};
use footage::{ACCENT, Canvas, draw_limbs, line_width};
use inputs::Joints;
use inputs::library::Library;
use inputs::pictures::{self, Frames, Picture, Pictures, Searched};
use inputs::sheet::{Sheet, Skeleton, limbs};
use kernels::Rgb8View;
use serde_json::json;
use skeleton::{JointSet, PARSE14};
use terminal::{Outline, outline, output};

use crate::describe::{self, NamedJoints, Placed};
use by_network::Eyes;

/// Default of `--size`: the longest side of a searched image, in pixels.
const SIZE: usize = 1280;
/// Default of `--overlap`.
const OVERLAP: f64 = 0.1;

/// Default threshold of the shipped model if its parts are reported, chosen by measurement.
const SHIPPED_THRESHOLD: f64 = -0.5;

/// Default value of `--heat` if the shipped detector finds the boxes.
const LEAST_HEAT: f64 = 0.5;

/// Options of `parallax detect`.
#[derive(Debug, Args)]
#[command(after_help = "\
Pictures are rotated according to their orientation tag (EXIF). In a video every frame is searched, or every n-th frame with \
--every. Pictures that cannot be read are listed, and the other pictures are searched. The exit code is then 7, or 4 if no picture \
could be read.

As in a deployment, the shipped detector finds boxes, and the shipped network finds the joints in each box. At most --max boxes are used. \
A person's heat is the mean over the joints. People with less heat than --heat are left out. \
Each person is printed once, in order of heat. Use --network and --detector for your own networks (docs/networks.md), and --box for \
your own box.

The shipped detector was not trained on people smaller than an eighth of the picture's height. For such people, crop the picture, or give --box.

With --network none, --model, --joints or --joint-map, the filters find parts, and these are printed. A picture with a \
side longer than --size is then scaled down to that size. The output says so: \"searched at 1280x960 instead of 4000x3000\". People smaller than \
about 150 pixels in the scaled picture are not found. --full searches all pixels, and needs about 460 bytes of memory per pixel. \
The card configs/models/person.md lists the false alarms for each --threshold.

With --json, one line per image, with the best detection first:
    {\"image\", \"frame\" (of videos), \"width\", \"height\", \"network\", \"detections\": [{\"score\": mean
     over the joints, \"box\": [x1, y1, x2, y2], \"box_from\": \"given\" or \"detector\", \"box_score\" (with a detector),
     \"keypoints\": [{\"name\", \"x\", \"y\", \"score\"}], \"joints\": {name: [x, y]}}]}
and with the filters:
    {\"image\", \"frame\", \"width\", \"height\", \"searched\": [width, height], \"detections\": [{\"score\", \"level\", \"scale\",
     \"parts\": [{\"x\", \"y\", \"type\", \"box\": [x1, y1, x2, y2]}], \"joints\": {name: [x, y]}}]}
Coordinates are pixels of the whole image, rotated according to its tag. The centre of its top-left pixel is (0, 0). Types and levels are counted from 1.

Examples:
    parallax detect photo.jpg
    parallax detect folder/ --model parse.mat --threshold -0.5 --json > people.jsonl
    parallax detect *.png --overlay drawn/
    parallax detect clip.mp4 --every 10 --frames 20 --overlay drawn/
    parallax detect folder/ --sheet sheet.png
    parallax detect photo.jpg --network pose.onnx --box 120,40,300,460 --overlay drawn/
    parallax detect folder/ --network pose.onnx --detector boxes.onnx --detector-card configs/detectors/yolox.toml --json")]
pub(crate) struct Arguments {
    /// Images, folders of images, or videos.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// The model file. If not given, the person model that ships with Parallax.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Minimum heat of a person in a box from the detector. The heat is the mean over the joints, from 0 to 1. If not given, 0.5 with the
    /// shipped detector, and 0 with --detector.
    #[arg(long, value_name = "HEAT", value_parser = heat)]
    heat: Option<f64>,
    /// Minimum score of a detection by the filters. If not given, -0.5 for the shipped model. Other models use their trained
    /// threshold, but at most -1.
    #[arg(long, value_name = "SCORE", allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Non-maximum suppression of the filters: largest share of a better detection's boxes that a worse detection may cover. If not
    /// given, 0.1.
    #[arg(long, value_name = "SHARE")]
    overlap: Option<f64>,
    /// Maximum number of detections per image.
    #[arg(long, value_name = "N", default_value_t = 100)]
    max: usize,
    /// Longest side of an image that the filters search, in pixels. Larger images are scaled down. If not given, 1280.
    #[arg(long, value_name = "PIXELS", value_parser = side)]
    size: Option<usize>,
    /// Let the filters search all pixels, however large the image is.
    #[arg(long, conflicts_with = "size")]
    full: bool,
    /// Search every n-th frame of a video.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Search at most this many frames of a video.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Print one line of JSON per image.
    #[arg(long)]
    json: bool,
    /// Draw the detections, and write the drawings to this folder as PNG files.
    #[arg(long, value_name = "DIR")]
    overlay: Option<PathBuf>,
    /// Draw thumbnails with the best detection of every image into this PNG file. For more than 40 images, several
    /// files are written, with numbers before the extension.
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Joint set of the filters: parse14 (if not given), umpm15 or humaneva20.
    #[arg(long, value_name = "NAME", value_parser = describe::joint_set)]
    joints: Option<&'static JointSet>,
    /// Mapping from the filters' parts to joints: a file of `train joints`, "shipped" or "none". If not given, "shipped": the mapping for
    /// the shipped model. With "none", and for other models, each joint is the centre of its part.
    #[arg(long, value_name = "FILE")]
    joint_map: Option<PathBuf>,
    /// Network (.onnx) that finds the keypoints, "shipped" or "none". With "none", the filters find parts instead. If not given, the
    /// shipped network, unless --model, --joints or --joint-map is given.
    #[arg(long, value_name = "FILE")]
    network: Option<PathBuf>,
    /// Card of the network. If not given, the file beside the network with the ending .toml, or the network's entry `parallax.card`.
    #[arg(long, value_name = "CARD", requires = "network")]
    card: Option<PathBuf>,
    /// Box around the person, in pixels of the picture: left, top, right, bottom. If not given, the detector finds the box.
    #[arg(long = "box", value_name = "X1,Y1,X2,Y2", value_parser = outline, allow_hyphen_values = true)]
    outline: Option<Outline>,
    /// Also show the network the mirror image of every person, and use the mean. This is more accurate, but takes twice as long.
    #[arg(long)]
    mirror: bool,
    /// Detector of people (.onnx) that finds the boxes, in place of the shipped detector.
    #[arg(long, value_name = "FILE", conflicts_with = "outline")]
    detector: Option<PathBuf>,
    /// Card of the detector. If not given, the file beside the detector with the ending .toml, or the detector's entry `parallax.card`.
    #[arg(long, value_name = "CARD", requires = "detector")]
    detector_card: Option<PathBuf>,
}

impl Arguments {
    /// Returns the network that finds the keypoints, or `None` if the filters find parts.
    ///
    /// # Errors
    ///
    /// Fails if an option of the filters is given with a network, or the other way round.
    fn network(&self) -> Result<Option<&Path>, Failure> {
        /// Number of options at the beginning of the list that also select the filters.
        const N_IMPLY: usize = 3;
        let of_filters = [
            (self.joints.is_some(), "--joints"),
            (self.joint_map.is_some(), "--joint-map"),
            (self.model.is_some(), "--model"),
            (self.threshold.is_some(), "--threshold"),
            (self.overlap.is_some(), "--overlap"),
            (self.size.is_some(), "--size"),
            (self.full, "--full"),
        ];
        let of_network = [
            (self.outline.is_some(), "--box"),
            (self.mirror, "--mirror"),
            (self.detector.is_some(), "--detector"),
            (self.card.is_some(), "--card"),
            (self.heat.is_some(), "--heat"),
        ];
        let given = |options: &[(bool, &'static str)]| {
            let mut given = options.iter().filter(|option| option.0);
            given.next().map(|option| option.1)
        };
        let network = match self.network.as_deref() {
            Some(file) => (!deployment::is_none(file)).then_some(file),
            None => given(&of_filters[..N_IMPLY]).is_none().then(|| Path::new(deployment::SHIPPED)),
        };
        let wrong = match network {
            Some(_) => {
                given(&of_filters).map(|option| (option, "the filters", "a network", "none"))
            }
            None => given(&of_network)
                .map(|option| (option, "a network", "the filters", deployment::SHIPPED)),
        };
        match wrong {
            None => Ok(network),
            Some((option, of, by, other)) => {
                let message =
                    format!("{option} is an option of {of}, but {by} would find the keypoints");
                let hint = format!("leave {option} out, or give --network {other}");
                Err(Failure::new(ExitKind::Usage, message).with_hint(hint))
            }
        }
    }

    /// Loads the network and the detector. Returns `None` if the filters find the parts.
    fn eyes(&self, network: Option<&Path>) -> Result<Option<Eyes>, Failure> {
        let Some(file) = network else {
            return Ok(None);
        };
        let named = (file, self.card.as_deref());
        let mut network = inputs::open_network(named, &Library::BuiltIn)?.fitted()?;
        if self.mirror {
            network = inputs::mirrored(network, "--mirror")?;
        }
        let card = self.detector_card.as_deref();
        let detector = self.detector.as_deref();
        let least_heat = detector.map_or(LEAST_HEAT, |_| 0.0);
        let detector = detector.unwrap_or(Path::new(deployment::SHIPPED));
        Ok(Some(Eyes {
            file: file.to_path_buf(),
            network,
            detector: inputs::detector::open(detector, card)?,
            least_heat: self.heat.unwrap_or(least_heat),
        }))
    }

    /// Returns the frames of a video to search.
    fn wanted(&self) -> Frames {
        Frames {
            every: self.every,
            most: self.frames,
        }
    }
}

/// Parses the longest side of a searched image, in pixels.
fn side(text: &str) -> Result<usize, String> {
    let side = text.parse().ok().filter(|value| (40..=65535).contains(value));
    side.ok_or_else(|| format!("expected 40 to 65535 pixels, got {text:?}"))
}

fn heat(text: &str) -> Result<f64, String> {
    let heat = text.parse().ok().filter(|value| (0.0..=1.0).contains(value));
    heat.ok_or_else(|| format!("expected 0 to 1, got {text:?}"))
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let detector = Detector::new(arguments)?;
    if let Some(folder) = &arguments.overlay {
        inputs::make_folder(folder)?;
    }
    let files = inputs::images::listed(&arguments.images)?;
    let mut sheet = arguments.sheet.as_ref().map(|sheet| {
        let n_pictures = files.iter().map(|file| pictures::count(file, arguments.wanted()));
        Sheet::new(sheet.clone(), n_pictures.sum())
    });
    let (mut n_searched, mut n_failed) = (0_u64, 0_usize);
    for file in &files {
        let searched = detector.file(file, sheet.as_mut(), &mut n_searched)?;
        let Err(failure) = searched else {
            continue;
        };
        if let [_] = &files[..] {
            return Err(failure);
        }
        n_failed += 1;
        output::failure(&failure);
    }
    if let Some(sheet) = sheet {
        sheet.finish()?;
    }
    match n_failed {
        0 => Ok(ExitCode::SUCCESS),
        n => {
            let message = format!(
                "{n} of {} files could not be searched completely",
                files.len()
            );
            let kind = if n_searched == 0 {
                ExitKind::Input
            } else {
                ExitKind::Degraded
            };
            Err(Failure::new(kind, message).with_hint("the messages above say why"))
        }
    }
}

struct Detector<'a> {
    arguments: &'a Arguments,
    joints: NamedJoints,
    search: Search,
    settings: CandidateSettings,
    eyes: Option<Eyes>,
}

impl<'a> Detector<'a> {
    /// Reads the model, the joints and the network.
    fn new(arguments: &'a Arguments) -> Result<Self, Failure> {
        let model = inputs::model_or_shipped(arguments.model.as_deref())?;
        let network = arguments.network()?;
        let threshold = match arguments.model {
            None => SHIPPED_THRESHOLD,
            Some(_) => model.detection_threshold(),
        };
        let joint_map = arguments.joint_map.as_deref();
        let joint_map = joint_map.unwrap_or(Path::new(deployment::SHIPPED));
        let joints = Joints::of(joint_map, arguments.model.as_deref())?;
        let set = arguments.joints.unwrap_or(&PARSE14);
        Ok(Self {
            arguments,
            joints: NamedJoints {
                set,
                map: joints.map(None, set),
            },
            settings: CandidateSettings {
                threshold: arguments.threshold.unwrap_or(threshold) as f32,
                overlap: arguments.overlap.unwrap_or(OVERLAP),
                max: arguments.max,
            },
            search: Search::new(model),
            eyes: arguments.eyes(network)?,
        })
    }
}

impl Detector<'_> {
    /// Searches all pictures of a file.
    ///
    /// # Errors
    ///
    /// An inner error concerns only this file, so that other files can still be searched. An outer error ends the command.
    fn file(
        &self,
        path: &Path,
        mut sheet: Option<&mut Sheet>,
        n_searched: &mut u64,
    ) -> Result<Result<(), Failure>, Failure> {
        let mut pictures = match Pictures::open(path, self.arguments.wanted()) {
            Ok(pictures) => pictures,
            Err(failure) => return Ok(Err(failure)),
        };
        loop {
            let picture = match pictures.next_picture() {
                Ok(Some(picture)) => picture,
                Ok(None) => return Ok(Ok(())),
                Err(failure) => return Ok(Err(failure)),
            };
            if let Some(eyes) = &self.eyes {
                match self.look(eyes, &picture, sheet.as_deref_mut())? {
                    Ok(()) => *n_searched += 1,
                    Err(failure) => return Ok(Err(failure)),
                }
                continue;
            }
            let size = self.longest();
            let searched = match Searched::new(&picture, size, &self.search) {
                Ok(searched) => searched,
                Err(failure) => return Ok(Err(failure)),
            };
            let found = self.detect(searched.image(&picture)?, searched.layout());
            *n_searched += 1;
            self.report(&picture, &searched, &found)?;
            self.draw(&picture, &searched, &found)?;
            if let Some(sheet) = sheet.as_deref_mut() {
                let best = found.first().map(|pose| self.skeleton(&searched, pose));
                sheet.add(&picture.title(), picture.size, &picture.rgb, best.as_ref())?;
            }
        }
    }

    /// Returns the longest side to search, in pixels, or `None` to search all pixels.
    fn longest(&self) -> Option<usize> {
        (!self.arguments.full).then(|| self.arguments.size.unwrap_or(SIZE))
    }

    fn report(
        &self,
        picture: &Picture,
        searched: &Searched,
        found: &[Pose],
    ) -> Result<(), Failure> {
        let (layout, model) = (searched.layout(), &self.search.model);
        if self.arguments.json {
            let placed = |pose| Placed::new(pose, model, layout).scaled(searched.per_pixel());
            let detections = found.iter().map(placed);
            let detections: Vec<_> =
                detections.map(|detection| detection.json(Some(&self.joints))).collect();
            let mut line = json!({
                "image": picture.path,
                "width": picture.size.width,
                "height": picture.size.height,
                "searched": layout.image_size,
                "detections": detections,
            });
            if let Some(frame) = picture.frame {
                line["frame"] = json!(frame);
            }
            return output::json(&line);
        }
        let mut notes = Vec::new();
        if !picture.turn.is_none() {
            notes.push(picture.turn.to_string());
        }
        let [width, height] = layout.image_size;
        let whole = picture.size;
        if [width, height] != [whole.width, whole.height] {
            notes.push(format!("searched at {width}x{height} instead of {whole}"));
        }
        let notes = [String::new()].into_iter().chain(notes);
        let notes = notes.collect::<Vec<_>>().join("; ");
        let n = found.len();
        let detections = if n == 1 { "detection" } else { "detections" };
        let frame = picture.frame.map_or(String::new(), |frame| format!(" frame {frame}"));
        output::line(format_args!(
            "{}{frame}: {n} {detections}{notes}",
            picture.path.display()
        ))?;
        for pose in found {
            let [x, y] = searched.in_picture(pose.centre(model, layout, 0));
            output::line(format_args!(
                "  score {:8.4}  level {:2}  head at ({x:.1}, {y:.1})",
                pose.score,
                pose.level + 1
            ))?;
        }
        Ok(())
    }

    fn detect(&self, image: Rgb8View<'_>, layout: &Layout) -> Vec<Pose> {
        let Self {
            search, settings, ..
        } = self;
        search.on(image, layout, |responses| {
            search.solver.candidates(responses, settings)
        })
    }

    fn skeleton(&self, searched: &Searched, pose: &Pose) -> Skeleton {
        let centres = pose.centres(&self.search.model, searched.layout());
        Skeleton {
            points: centres.into_iter().map(|centre| searched.in_picture(centre)).collect(),
            limbs: limbs(&self.search.model),
            score: pose.score,
        }
    }

    /// Draws the detections if overlays are requested. The best detection is drawn last, on top.
    fn draw(&self, picture: &Picture, searched: &Searched, found: &[Pose]) -> Result<(), Failure> {
        let Some(folder) = &self.arguments.overlay else {
            return Ok(());
        };
        let mut canvas = Canvas::from_rgb(picture.size, &picture.rgb);
        let label_offset = 4.0 * line_width(picture.size);
        for pose in found.iter().rev() {
            let skeleton = self.skeleton(searched, pose);
            draw_limbs(&mut canvas, &skeleton.points, &skeleton.limbs);
            let [x, y] = skeleton.points[0];
            canvas.label([x + label_offset, y], &format!("{:.2}", pose.score), ACCENT);
        }
        let file = folder.join(format!("{}.png", picture.stem()));
        canvas.save_png(&file).or_fail(ExitKind::Input)
    }
}
