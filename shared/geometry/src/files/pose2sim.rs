//! Camera tables in TOML, as written by Pose2Sim, anipose, Caliscope and `FreeMoCap`.
//!
//! A table with a `matrix` is a camera, at the top level (`[cam_01]`) or under `cameras` (`[cameras.0]`, Caliscope, named `cam_0` if it has
//! no `name`). The order of the file is kept. `rotation` is a Rodrigues vector or a 3x3 matrix, world to camera. `translation` is in metres
//! for Pose2Sim and Caliscope, but in the unit of the board (usually millimetres) for anipose and `FreeMoCap`; set [`ReadOptions::unit`]
//! for these. The files do not state the up direction, which is z for Pose2Sim.

use toml::{Table, Value};

use super::{
    ParseError, ReadOptions, Unit, UnwritableRig, entry::Entry, numbers, toml_fields::Fields,
};
use crate::{Camera, Rig};

/// Returns true if a text is TOML with at least one camera.
pub(super) fn is_pose2sim(text: &str) -> bool {
    text.parse::<Table>().is_ok_and(|table| !camera_tables(&table).is_empty())
}

/// Reads a camera file.
///
/// Tables with `ignore = true` are not cameras. Cameras without rotation and translation, which is how Caliscope writes cameras that it
/// could not place, are left out.
///
/// # Errors
///
/// See [`ParseError`].
pub fn parse(text: &str, options: &ReadOptions) -> Result<Rig, ParseError> {
    let table: Table = text.parse().map_err(|error: toml::de::Error| ParseError::Syntax {
        format: "TOML",
        source: Box::new(error),
    })?;
    let cameras = camera_tables(&table)
        .into_iter()
        .map(|(key, fields)| camera(key, &fields, options))
        .collect::<Result<Vec<_>, _>>()?;
    if cameras.is_empty() {
        return Err(ParseError::NoCameras {
            expected: "a table with the key `matrix` for each view",
        });
    }
    super::entry::rig(cameras, options.up, "", options)
}

/// Returns the tables that are cameras, each with its default name.
fn camera_tables(table: &Table) -> Vec<(String, Fields<'_>)> {
    let top = table.iter().map(|(key, value)| (key.clone(), key.clone(), value));
    let nested = table.get("cameras").and_then(Value::as_table).into_iter().flatten();
    let nested = nested.map(|(key, value)| (format!("cameras.{key}"), nested_name(key), value));
    top.chain(nested)
        .filter_map(|(path, name, value)| {
            let table = value.as_table()?;
            let ignored = table.get("ignore").and_then(Value::as_bool) == Some(true);
            (table.contains_key("matrix") && !ignored).then_some((name, Fields { table, path }))
        })
        .collect()
}

fn nested_name(key: &str) -> String {
    if key.bytes().all(|b| b.is_ascii_digit()) {
        format!("cam_{key}")
    } else {
        key.to_owned()
    }
}

fn camera(key: String, fields: &Fields<'_>, options: &ReadOptions) -> Result<Entry, ParseError> {
    let name = match fields.table.get("name") {
        None => key,
        Some(Value::String(name)) => name.clone(),
        Some(other) => {
            return Err(ParseError::Shape {
                field: fields.field("name"),
                expected: "a string",
                found: other.type_str().to_owned(),
            });
        }
    };
    if !fields.has("matrix") {
        return Ok(Entry::name(&name, "its file has neither a lens nor a pose"));
    }
    let [width, height] = fields.array::<2>("size")?;
    let size_field = fields.field("size");
    let size = [
        numbers::pixels(&size_field, width)?,
        numbers::pixels(&size_field, height)?,
    ];
    let fisheye = fields.table.get("fisheye").and_then(Value::as_bool).unwrap_or(false);
    let coefficients = fields.list("distortions")?;
    let lens = numbers::lens(&fields.field("distortions"), &coefficients, fisheye)?;
    let intrinsics = numbers::intrinsics(
        &fields.field("matrix"),
        &fields.matrix("matrix")?,
        size,
        lens,
    )?;
    if !fields.has("rotation") && !fields.has("translation") {
        return Ok(Entry::lens(&name, intrinsics));
    }
    let is_matrix = fields.get("rotation")?.get(0).is_some_and(Value::is_array);
    let rotation_field = fields.field("rotation");
    let rotation = if is_matrix {
        numbers::rotation(&rotation_field, &fields.matrix("rotation")?)?
    } else {
        numbers::rodrigues(&rotation_field, fields.array("rotation")?)?
    };
    let unit = options.unit.unwrap_or(Unit::Metres);
    let translation = fields.array("translation")?;
    let pose = numbers::pose(&fields.field("translation"), rotation, translation, unit)?;
    Ok(Entry::Placed(Camera {
        name,
        intrinsics,
        camera_from_world: pose,
    }))
}

/// Writes a Pose2Sim file, in metres. The up direction and the source of the rig are lost.
///
/// # Errors
///
/// Fails with [`UnwritableRig::Name`] for a camera named `metadata` or `cameras`, because these names have another meaning in the format.
pub fn write(rig: &Rig) -> Result<String, UnwritableRig> {
    let table = |camera| camera_table(camera, Unit::Metres);
    let tables: Result<String, _> = rig.cameras().iter().map(table).collect();
    Ok(tables? + "[metadata]\nadjusted = false\nerror = 0.0\n")
}

/// Writes a file for anipose and `FreeMoCap`: in millimetres, with image sizes that are whole numbers.
///
/// # Errors
///
/// Fails like [`write()`].
pub fn write_anipose(rig: &Rig) -> Result<String, UnwritableRig> {
    let table = |camera| camera_table(camera, Unit::Millimetres);
    let tables: Result<String, _> = rig.cameras().iter().map(table).collect();
    Ok(tables? + "[metadata]\n")
}

fn camera_table(camera: &Camera, unit: Unit) -> Result<String, UnwritableRig> {
    if ["metadata", "cameras"].contains(&camera.name.as_str()) {
        return Err(UnwritableRig::Name {
            camera: camera.name.clone(),
            format: "Pose2Sim",
        });
    }
    let intrinsics = &camera.intrinsics;
    let [width, height] = intrinsics.size;
    let k =
        numbers::rows(&intrinsics.matrix()).map(|row| format!("[{}]", numbers::joined(row, ", ")));
    let (coefficients, fisheye) = numbers::distortion(intrinsics.lens.model());
    let pose = &camera.camera_from_world;
    let translation = pose.translation.vector * unit.per_metre();
    // Pose2Sim writes floats; anipose accepts only whole numbers for the image size.
    let size = match unit {
        Unit::Metres => format!("{width}.0, {height}.0"),
        _ => format!("{width}, {height}"),
    };
    Ok(format!(
        "[{key}]\nname = {name}\nsize = [{size}]\nmatrix = [{k}]\n\
         distortions = [{distortions}]\nrotation = [{rotation}]\ntranslation = [{translation}]\n\
         fisheye = {fisheye}\n\n",
        key = quoted_key(&camera.name),
        name = Value::from(camera.name.as_str()),
        k = k.join(", "),
        distortions = numbers::joined(&coefficients, ", "),
        rotation = numbers::joined(pose.rotation.scaled_axis().iter(), ", "),
        translation = numbers::joined(translation.iter(), ", "),
    ))
}

/// Returns a name as the key of a table: bare if possible, otherwise as a basic string.
fn quoted_key(name: &str) -> String {
    let bare = name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare && !name.is_empty() {
        return name.to_owned();
    }
    let escaped = name.chars().map(|c| match c {
        '"' => "\\\"".to_owned(),
        '\\' => "\\\\".to_owned(),
        c if c.is_control() => format!("\\u{:04X}", u32::from(c)),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>())
}
