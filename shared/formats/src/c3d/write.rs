//! Writing of points over time, as Intel reals with a section of parameters.

use std::io::{self, Write};

use crate::c3d::numbers::BLOCK;

/// Maximum number of characters in the name or description of a point; one byte holds the length.
const MAX_TEXT: usize = 127;
/// Maximum number of names in one parameter; the format stores this number in one byte.
const MAX_TEXTS: usize = 255;
/// Maximum number of blocks of parameters; the format stores this number in one byte.
const MAX_BLOCKS: usize = 255;
/// Maximum residual, in steps; the format stores it in one byte.
const MAX_RESIDUAL: f64 = 255.0;

/// Header of a file, before its points; see [`write()`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading<'a> {
    /// Frames per second.
    pub rate_hz: f64,
    /// Unit of the positions: `mm` or `m`.
    pub units: &'a str,
    /// Axis that points up, such as `+Z` (`POINT:Y_SCREEN`).
    pub up: &'a str,
    /// Names of the points. Characters beyond Latin-1 become question marks, and names are cut after 127 characters.
    pub labels: &'a [String],
    /// Description of each point, in the order of the names. The list may be empty.
    pub descriptions: &'a [String],
    /// Number of frames that follow.
    pub n_frames: u32,
    /// Number of the first frame, counted from 1. It is ignored if a frame would have a number above 65535; the frames are then counted
    /// from 1.
    pub first_frame: u32,
    /// Unit in which residuals are stored, in the unit of the file. A residual is a whole number of these steps, at most 255.
    pub residual_step: f64,
    /// Name and version of the program that writes the file.
    pub software: [&'a str; 2],
}

/// A point that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Position, in the unit of the file.
    pub position: [f64; 3],
    /// Uncertainty of the position, in the unit of the file; 0 if it is not known.
    pub residual: f64,
    /// Bit mask of the cameras: bit `c` is set if camera `c` of the first seven saw the point.
    pub cameras: u8,
}

/// Writes a file. A point that is `None` is written at 0 with residual -1, as the format specifies.
///
/// ```
/// use formats::c3d::{C3d, Heading, Marker};
///
/// let heading = Heading {
///     rate_hz: 60.0,
///     units: "mm",
///     up: "+Z",
///     labels: &["head".to_owned(), "neck".to_owned()],
///     descriptions: &[],
///     n_frames: 1,
///     first_frame: 1,
///     residual_step: 0.5,
///     software: ["mine", "1.0"],
/// };
/// let head = Marker { position: [1.0, 2.0, 1700.0], residual: 12.0, cameras: 0b11 };
/// let mut file = Vec::new();
/// formats::c3d::write(&mut file, &heading, [vec![Some(head), None]])?;
/// let read = C3d::parse(&file).unwrap();
/// assert_eq!(read.frame(0), [Some([1.0, 2.0, 1700.0]), None]);
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
///
/// Fails if writing to `out` fails, if the names do not fit into the format, or if the number of frames or points differs from the declared
/// number.
pub fn write(
    out: &mut impl Write,
    heading: &Heading<'_>,
    frames: impl IntoIterator<Item = Vec<Option<Marker>>>,
) -> io::Result<()> {
    let parameters = parameters(heading)?;
    out.write_all(&header(heading, &parameters)?)?;
    out.write_all(&parameters)?;
    let (mut n_frames, mut n_bytes) = (0, 0);
    for points in frames {
        if points.len() != heading.labels.len() {
            let (got, due) = (points.len(), heading.labels.len());
            return Err(refused(&format!(
                "a frame has {got} points, but the heading announces {due}"
            )));
        }
        for point in points {
            let bytes = numbers(point.as_ref(), heading.residual_step);
            n_bytes += bytes.len();
            out.write_all(&bytes)?;
        }
        n_frames += 1;
    }
    if n_frames != heading.n_frames {
        let due = heading.n_frames;
        return Err(refused(&format!(
            "{n_frames} frames were given, but the heading announces {due}"
        )));
    }
    if heading.n_frames > u32::from(u16::MAX) {
        // The last block is not filled up, because readers such as `ezc3d` would count the padding of long files as more frames.
        return Ok(());
    }
    out.write_all(&vec![0; n_bytes.next_multiple_of(BLOCK) - n_bytes])
}

fn refused(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, format!("C3D: {why}"))
}

/// Returns the four reals of a point; the fourth contains the cameras and the residual.
fn numbers(point: Option<&Marker>, step: f64) -> [u8; 16] {
    let values = point.map_or([0.0, 0.0, 0.0, -1.0], |point| {
        let [x, y, z] = point.position.map(|value| value as f32);
        let steps = (point.residual / step).round().clamp(0.0, MAX_RESIDUAL);
        // A residual of NaN means that the residual is unknown.
        let steps = if steps.is_nan() { 0.0 } else { steps };
        let cameras = f32::from(point.cameras & 0x7f);
        [x, y, z, cameras * 256.0 + steps as f32]
    });
    let mut bytes = [0; 16];
    for (slot, value) in bytes.as_chunks_mut().0.iter_mut().zip(values) {
        *slot = value.to_le_bytes();
    }
    bytes
}

impl Heading<'_> {
    /// Returns the numbers of the first and the last frame.
    fn range(&self) -> [u32; 2] {
        let first = self.first_frame.max(1);
        let last = first.saturating_add(self.n_frames).saturating_sub(1);
        if last > u32::from(u16::MAX) {
            [1, self.n_frames.max(1)]
        } else {
            [first, last]
        }
    }
}

fn header(heading: &Heading<'_>, parameters: &[u8]) -> io::Result<Vec<u8>> {
    let n_points = u16::try_from(heading.labels.len());
    let n_points = n_points.map_err(|_error| refused("more than 65535 points"))?;
    let [first, last] = heading.range().map(clamped);
    let mut file = vec![2, 0x50];
    for word in [n_points, 0, first, last, 0] {
        file.extend(word.to_le_bytes());
    }
    file.extend((-heading.residual_step as f32).to_le_bytes());
    file.extend(data_block(parameters).to_le_bytes());
    file.extend(0_u16.to_le_bytes());
    file.extend((heading.rate_hz as f32).to_le_bytes());
    file.resize(BLOCK, 0);
    Ok(file)
}

fn clamped(number: u32) -> u16 {
    u16::try_from(number).unwrap_or(u16::MAX)
}

/// Returns the block at which the points begin, from 1.
fn data_block(parameters: &[u8]) -> u16 {
    (2 + parameters.len() / BLOCK) as u16
}

/// Groups of parameters, as bytes.
#[derive(Default)]
struct Section {
    bytes: Vec<u8>,
    group: i8,
}

impl Section {
    fn group(&mut self, name: &str) {
        self.group += 1;
        self.entry(name, -self.group, &[0]);
    }

    fn entry(&mut self, name: &str, id: i8, body: &[u8]) {
        self.bytes.extend([name.len() as u8, id as u8]);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend((2 + body.len() as u16).to_le_bytes());
        self.bytes.extend(body);
    }

    /// Adds a parameter.
    ///
    /// * `kind`: -1 for characters, otherwise the number of bytes of a number.
    /// * `sizes`: sizes of the value; the first index varies fastest.
    fn parameter(&mut self, name: &str, kind: i8, sizes: &[u8], data: &[u8]) {
        let mut body = vec![kind as u8, sizes.len() as u8];
        body.extend(sizes);
        body.extend(data);
        body.push(0);
        self.entry(name, self.group, &body);
    }

    fn word(&mut self, name: &str, value: u16) {
        self.parameter(name, 2, &[], &value.to_le_bytes());
    }

    fn real(&mut self, name: &str, value: f64) {
        self.parameter(name, 4, &[], &(value as f32).to_le_bytes());
    }

    fn text(&mut self, name: &str, value: &str) {
        let text = latin(value);
        self.parameter(name, -1, &[text.len() as u8], &text);
    }

    /// Adds texts as `NAME`, then `NAME2` and so on, because one parameter has at most 255 texts.
    fn texts(&mut self, name: &str, values: &[String]) {
        for (nth, values) in values.chunks(MAX_TEXTS).enumerate() {
            let texts: Vec<Vec<u8>> = values.iter().map(|value| latin(value)).collect();
            let width = texts.iter().map(Vec::len).max().unwrap_or(0);
            let padded = texts.iter().flat_map(|text| {
                let blanks = core::iter::repeat_n(b' ', width - text.len());
                text.iter().copied().chain(blanks)
            });
            let name = match nth {
                0 => name.to_owned(),
                _ => format!("{name}{}", nth + 1),
            };
            let sizes = [width as u8, values.len() as u8];
            self.parameter(&name, -1, &sizes, &padded.collect::<Vec<u8>>());
        }
    }
}

/// Encodes a text as Latin-1, the largest character set that readers expect.
fn latin(text: &str) -> Vec<u8> {
    let bytes = text.chars().map(|c| u8::try_from(c).unwrap_or(b'?'));
    bytes.take(MAX_TEXT).collect()
}

fn parameters(heading: &Heading<'_>) -> io::Result<Vec<u8>> {
    // One parameter is the position at which the points begin; its value does not change the length of the section.
    let n_bytes = section(heading, 0).len();
    if n_bytes / BLOCK > MAX_BLOCKS {
        let n = heading.labels.len();
        return Err(refused(&format!(
            "the names of {n} points take {n_bytes} bytes, which is more than the format has room for"
        )));
    }
    Ok(section(heading, (2 + n_bytes / BLOCK) as u16))
}

/// Returns the whole section, padded to whole blocks.
fn section(heading: &Heading<'_>, data_block: u16) -> Vec<u8> {
    let mut all = Section::default();
    let [first, last] = heading.range();
    all.group("POINT");
    all.word("USED", clamped(heading.labels.len() as u32));
    all.real("SCALE", -heading.residual_step);
    all.real("RATE", heading.rate_hz);
    all.word("DATA_START", data_block);
    // Some readers require a 16-bit whole number here. Files with more frames have the number of frames in LONG_FRAMES and in TRIAL.
    all.word("FRAMES", clamped(heading.n_frames));
    if heading.n_frames > u32::from(u16::MAX) {
        all.real("LONG_FRAMES", f64::from(heading.n_frames));
    }
    all.texts("LABELS", heading.labels);
    if !heading.descriptions.is_empty() {
        all.texts("DESCRIPTIONS", heading.descriptions);
    }
    all.text("UNITS", heading.units);
    all.text("X_SCREEN", "+X");
    all.text("Y_SCREEN", heading.up);
    // Other programs expect these groups even in files with points only.
    all.group("ANALOG");
    all.word("USED", 0);
    all.parameter("LABELS", -1, &[0, 0], &[]);
    all.real("GEN_SCALE", 1.0);
    // The number of samples per frame is 0 here and in the header, because some readers refuse a file with only one of the two.
    all.real("RATE", 0.0);
    all.parameter("SCALE", 4, &[0], &[]);
    all.parameter("OFFSET", 2, &[0], &[]);
    all.parameter("UNITS", -1, &[0, 0], &[]);
    all.group("FORCE_PLATFORM");
    all.word("USED", 0);
    all.group("TRIAL");
    for (name, frame) in [("ACTUAL_START_FIELD", first), ("ACTUAL_END_FIELD", last)] {
        all.parameter(name, 2, &[2], &frame.to_le_bytes());
    }
    all.real("CAMERA_RATE", heading.rate_hz);
    all.group("MANUFACTURER");
    all.text("COMPANY", heading.software[0]);
    all.text("SOFTWARE", heading.software[0]);
    all.text("VERSION_LABEL", heading.software[1]);

    let n_blocks = (4 + all.bytes.len() + 2).div_ceil(BLOCK);
    let mut section = vec![1, 0x50, n_blocks.min(MAX_BLOCKS) as u8, 84];
    section.extend(all.bytes);
    section.resize(n_blocks * BLOCK, 0);
    section
}

#[cfg(test)]
mod tests;
