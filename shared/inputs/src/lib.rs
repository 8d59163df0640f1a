//! Reads and checks the files that users name, before any process starts: rigs, models, networks with their cards, tables, and the files
//! that ship with Parallax. This crate also reads pictures and videos for trying networks. Every error names the file and suggests what to
//! do.
#![forbid(unsafe_code)]

pub mod advice;
mod joints;
mod maps;
mod memory;
mod refused;
mod shipped;

pub mod cards;
pub mod described;
pub mod detector;
pub mod images;
pub mod library;
pub mod network;
pub mod pictures;
pub mod sheet;

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _, no_text};
use fmp::Model;
use geometry::Rig;
use geometry::files::{ReadOptions, RigFileError};
use multiview::learned::{Appearance, Learned, Shape};
use multiview::{Compatibility, TypeTables};
use pipeline::PairTables;
use viewquality::orientation::Detector;
use viewquality::{Network, NetworkError, Table, Tau};

pub use cards::card_beside;
pub use failure::{in_file, read_text as text};
pub use joints::Joints;
pub use maps::{check_maps, detector, mirrored, network_card, open_network, pose_network};
pub use shipped::Shipped;

/// Reads the named model, or the shipped model if none is named.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a model.
pub fn model_or_shipped(path: Option<&Path>) -> Result<Arc<Model>, Failure> {
    path.map_or_else(shipped_model, model)
}

/// Returns the bytes of the named model file, or of the shipped model if none is named.
///
/// # Errors
///
/// Fails if the file cannot be read, or is empty.
pub fn model_bytes(path: Option<&Path>) -> Result<Cow<'static, [u8]>, Failure> {
    path.map_or_else(
        || Ok(Cow::Borrowed(Shipped::Model.bytes())),
        |path| Shipped::Model.read(path),
    )
}

fn shipped_model() -> Result<Arc<Model>, Failure> {
    let spec = fmp::files::own::decode(Shipped::Model.bytes()).or_fail(ExitKind::Input)?;
    Model::new(spec).map(Arc::new).or_fail(ExitKind::Input)
}

/// Reads a model of any supported format.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a model.
pub fn model(path: &Path) -> Result<Arc<Model>, Failure> {
    if deployment::is_shipped(path) {
        return shipped_model();
    }
    fmp::files::read(path).map(Arc::new).or_fail(ExitKind::Input)
}

/// Reads a calibration of any supported format.
///
/// * `paths`: one file, or one file per camera.
///
/// # Errors
///
/// Fails if a file cannot be read, or is not a calibration; the hint suggests what to try.
pub fn rig(paths: &[impl AsRef<Path>], options: &ReadOptions) -> Result<Rig, Failure> {
    let paths: Vec<&Path> = paths.iter().map(AsRef::as_ref).collect();
    geometry::files::read_many(&paths, options).map_err(|error| {
        let kind = match error {
            RigFileError::Read { .. } | RigFileError::NoFiles => ExitKind::Input,
            _ => ExitKind::Calibration,
        };
        let hint = advice::on_rig(&error);
        let failure = Failure::new(kind, error);
        match hint {
            Some(hint) => failure.with_hint(hint),
            None => failure,
        }
    })
}

/// Reads the calibration of a deployment, and applies the deployment's `unit` and `up`.
///
/// # Errors
///
/// Fails like [`rig`].
pub fn rig_of(deployment: &Deployment) -> Result<Rig, Failure> {
    rig_with(deployment, ReadOptions::default())
}

/// Works like [`rig_of`], for uses that need only the lenses. A camera without a pose is placed at the origin.
///
/// # Errors
///
/// Fails like [`rig`].
pub fn lenses_of(deployment: &Deployment) -> Result<Rig, Failure> {
    let options = ReadOptions {
        lenses_suffice: true,
        ..ReadOptions::default()
    };
    rig_with(deployment, options)
}

fn rig_with(deployment: &Deployment, options: ReadOptions) -> Result<Rig, Failure> {
    let unit = deployment.unit.as_deref().map(str::parse).transpose();
    let options = ReadOptions {
        unit: unit.or_fail(ExitKind::Config)?,
        ..options
    };
    let read = rig(&[&deployment.rig], &options)?;
    let up = deployment.up.and_then(geometry::direction);
    Ok(match up {
        Some(up) => read.with_up(Some(up)),
        None => read,
    })
}

/// Returns a camera of a deployment from its rig.
///
/// # Errors
///
/// Fails if the rig has no such camera, or no pose for it.
pub fn camera_of<'a>(
    rig: &'a Rig,
    name: &str,
    deployment: &Deployment,
) -> Result<&'a geometry::Camera, Failure> {
    rig.camera(name).ok_or_else(|| {
        let file = deployment.rig.display();
        let message = format!("{file} has {}", rig.lacks(name));
        Failure::new(ExitKind::Calibration, message)
    })
}

/// Reads the part-type tables of a pair of views.
///
/// * `files`: the tables `first wrt second` and `second wrt first`.
///
/// # Errors
///
/// Fails if a file cannot be read, if its part types differ from the types in the model, or if the two tables contradict each other.
fn type_tables(files: [&Path; 2], model: &Model) -> Result<TypeTables, Failure> {
    let n_types: Vec<usize> = (0..model.n_parts()).map(|part| model.n_types(part)).collect();
    let read = |file: &Path| -> Result<Compatibility, Failure> {
        let text = text(file)?;
        let table = Compatibility::parse(&text, &n_types);
        table.map_err(|error| in_file(file, &error))
    };
    let [first, second] = [read(files[0])?, read(files[1])?];
    let (joint, contradiction) = Compatibility::joint_from_conditionals(&first, &second)
        .map_err(|error| in_file(files[1], &error))?;
    tracing::debug!(contradiction, "part-type tables of both directions");
    Ok(TypeTables {
        conditional: [Arc::new(first), Arc::new(second)],
        joint: Arc::new(joint),
        exchanged: None,
    })
}

/// Reads the learned multi-view consistency, if a file is named, and checks that it matches the model.
///
/// # Errors
///
/// Fails if the file cannot be read, or was trained with a different model.
pub fn learned(file: Option<&Path>, model: &Model) -> Result<Option<Learned>, Failure> {
    let Some(file) = file else {
        return Ok(None);
    };
    let bytes = Shipped::Consistency.read(file)?;
    let text = core::str::from_utf8(&bytes).map_err(|_odd| no_text(file))?;
    let learned = Learned::parse(text).map_err(|error| in_file(file, &error))?;
    let checked = learned.check_model(&Shape::of(model));
    checked.map_err(|error| in_file(file, &error))?;
    Ok(Some(learned))
}

/// Reads the network that estimates the direction in which a person faces. Returns `None` for the name `none`, and for the shipped network
/// if the parts of the model are not those that this network was trained for.
///
/// # Errors
///
/// Fails if the file cannot be read, is of a different kind, or does not fit the parts of the model.
pub fn orientation(file: &Path, model: &Model) -> Result<Option<Arc<Detector>>, Failure> {
    let has_head = model.n_parts() == skeleton::N_PARTS;
    if deployment::is_none(file) || (!has_head && deployment::is_shipped(file)) {
        return Ok(None);
    }
    if !has_head {
        let message = format!(
            "{} is for models with {} parts, but this model has {}",
            file.display(),
            skeleton::N_PARTS,
            model.n_parts()
        );
        return Err(Failure::new(ExitKind::Input, message));
    }
    let bytes = Shipped::Orientation.read(file)?;
    let network = viewquality::orientation::Network::from_bytes(&bytes)
        .map_err(|error| in_file(file, &error))?;
    Ok(Some(Arc::new(Detector::new(network))))
}

/// Returns the part-type tables of all pairs of the given cameras: the tables named in the settings, otherwise the learned tables.
///
/// # Errors
///
/// Fails if a table cannot be read, or if there are no learned tables for the rig that `paper.consistency` names.
pub fn pair_tables(
    config: &deployment::paper::Config,
    learned: Option<&Learned>,
    model: &Model,
    cameras: &[&str],
) -> Result<PairTables, Failure> {
    let index = |name: &String| cameras.iter().position(|camera| camera == name);
    let mut of_pairs = Vec::new();
    for entry in &config.compatibility {
        let [Some(first), Some(second)] = entry.views.each_ref().map(index) else {
            continue;
        };
        let mut files = entry.files.each_ref().map(PathBuf::as_path);
        if first > second {
            files.reverse();
        }
        of_pairs.push((
            first.min(second),
            first.max(second),
            type_tables(files, model)?,
        ));
    }
    let Some(learned) = learned else {
        let by_angle = None;
        return Ok(PairTables { of_pairs, by_angle });
    };
    let appearance = match config.energy {
        deployment::paper::Energy::Paper => learned.weights.appearance,
        deployment::paper::Energy::Released => Appearance::Joint,
    };
    let rig = config.consistency.as_ref().and_then(deployment::paper::Consistency::rig);
    if let Some(rig) = rig {
        let Some(own) = learned.of_rig(rig, cameras, appearance) else {
            let message =
                format!("the file in `paper.consistency` has no data for the rig {rig:?}");
            return Err(Failure::new(ExitKind::Config, message));
        };
        of_pairs.extend(own);
    }
    Ok(PairTables {
        of_pairs,
        by_angle: Some(Arc::new(learned.by_angle(appearance))),
    })
}

/// Reads a table of expected errors of a model with `n_parts` parts.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a table for this number of parts.
pub fn quality_table(file: &Path, n_parts: usize) -> Result<Table, Failure> {
    Table::parse(&text(file)?, n_parts).map_err(|error| in_file(file, &error))
}

/// Reads a network that predicts the expected errors of a model with `n_parts` parts.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a network for this number of parts.
pub fn network(file: &Path, n_parts: usize) -> Result<Network, Failure> {
    let bytes = Shipped::Network.read(file)?.into_owned();
    Network::parse(bytes, n_parts).map_err(|error| unusable(file, &error))
}

/// Reads the network that predicts expected errors, if there is one.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not a network for this number of parts.
pub fn quality_network(
    errors: Option<&deployment::paper::Errors>,
    n_parts: usize,
) -> Result<Option<Network>, Failure> {
    let file = errors.and_then(deployment::paper::Errors::network);
    file.map(|file| network(file, n_parts)).transpose()
}

/// Returns the failure for a network that cannot be used, with the cause that the library reports.
fn unusable(file: &Path, error: &NetworkError) -> Failure {
    let cause = std::error::Error::source(error).map(|cause| format!(": {cause}"));
    let message = format!("{}: {error}{}", file.display(), cause.unwrap_or_default());
    Failure::new(ExitKind::Input, message)
}

/// Reads the thresholds (tau) of a model with `n_parts` parts, in pixels.
///
/// # Errors
///
/// Fails if the file cannot be read, or does not have one threshold per part.
pub fn tau(file: &Path, n_parts: usize) -> Result<Vec<f32>, Failure> {
    let tau = Tau::parse(&text(file)?, n_parts).map_err(|error| in_file(file, &error))?;
    Ok(tau.px().to_vec())
}

/// Creates a folder for results.
///
/// # Errors
///
/// Fails if the folder cannot be created; the hint suggests what to try.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder).map_err(|error| advice::on_folder(folder, &error))
}
