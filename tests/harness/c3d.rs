//! Writer for C3D files in all six encodings, to test readers with known content.

/// Representation of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Processor {
    /// Little-endian, IEEE.
    Intel,
    /// Little-endian, DEC's F format.
    Dec,
    /// Big-endian, IEEE.
    Mips,
}

/// All three representations.
pub const PROCESSORS: [Processor; 3] = [Processor::Intel, Processor::Dec, Processor::Mips];

/// A trial to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Frames per second.
    pub rate_hz: f32,
    /// Unit of the positions, such as `mm`.
    pub units: String,
    /// Names of the points. If there are more than 255, they are written to several parameters.
    pub labels: Vec<String>,
    /// Positions as `[frame][point]`, in the unit; `None` where the point was not visible.
    pub frames: Vec<Vec<Option<[f64; 3]>>>,
    /// Number of analog values in every frame, which are written as zeros.
    pub n_analog: u16,
}

/// Returns the bytes of the file.
///
/// * `integer_scale`: size of an integer step, in the unit of the positions; `None` to write floating-point numbers.
///
/// # Panics
///
/// Panics if the number of points or frames does not fit into 16 bits.
pub fn write(trial: &Trial, processor: Processor, integer_scale: Option<f32>) -> Vec<u8> {
    let out = Out { processor };
    let parameters = parameters(&out, trial, integer_scale.unwrap_or(-1.0));
    let n_blocks = parameters.len().div_ceil(512);
    let first_data = 2 + n_blocks;
    let n = |value: usize| {
        assert!(
            u16::try_from(value).is_ok(),
            "{value} does not fit into 16 bits"
        );
        value as u16
    };
    let mut file = vec![2, 0x50];
    let words = [
        n(trial.labels.len()),
        trial.n_analog,
        1,
        n(trial.frames.len()),
        0,
    ];
    file.extend(words.iter().flat_map(|&word| out.word(word)));
    file.extend(out.real(integer_scale.unwrap_or(-1.0)));
    file.extend(out.word(n(first_data)));
    file.extend(out.word(u16::from(trial.n_analog > 0)));
    file.extend(out.real(trial.rate_hz));
    file.resize(512, 0);
    file.extend(parameters);
    file.resize(512 * (first_data - 1), 0);
    for frame in &trial.frames {
        for point in frame {
            let [x, y, z] = point.unwrap_or_default();
            let residual = if point.is_some() { 0 } else { -1_i16 };
            for value in [x, y, z] {
                match integer_scale {
                    Some(scale) => {
                        let steps = (value / f64::from(scale)).round() as i16;
                        file.extend(out.word(steps as u16));
                    }
                    None => file.extend(out.real(value as f32)),
                }
            }
            match integer_scale {
                Some(_) => file.extend(out.word(residual as u16)),
                None => file.extend(out.real(f32::from(residual))),
            }
        }
        let width = if integer_scale.is_some() { 2 } else { 4 };
        file.extend(vec![0; width * usize::from(trial.n_analog)]);
    }
    file
}

struct Out {
    processor: Processor,
}

impl Out {
    fn word(&self, value: u16) -> [u8; 2] {
        match self.processor {
            Processor::Intel | Processor::Dec => value.to_le_bytes(),
            Processor::Mips => value.to_be_bytes(),
        }
    }

    fn real(&self, value: f32) -> [u8; 4] {
        match self.processor {
            Processor::Intel => value.to_le_bytes(),
            Processor::Mips => value.to_be_bytes(),
            Processor::Dec => {
                let [a, b, c, d] = (value * 4.0).to_le_bytes();
                [c, d, a, b]
            }
        }
    }

    /// Returns the bytes of a group, or of a parameter of group 1.
    fn entry(&self, name: &str, id: i8, body: &[u8]) -> Vec<u8> {
        let mut entry = vec![name.len() as u8, id as u8];
        entry.extend(name.as_bytes());
        entry.extend(self.word(2 + body.len() as u16));
        entry.extend(body);
        entry
    }

    fn texts(&self, name: &str, texts: &[String]) -> Vec<u8> {
        let width = texts.iter().map(String::len).max().unwrap_or(0);
        let mut body = vec![-1_i8 as u8, 2, width as u8, texts.len() as u8];
        for text in texts {
            body.extend(text.bytes().chain(std::iter::repeat(b' ')).take(width));
        }
        body.push(0);
        self.entry(name, 1, &body)
    }

    fn number(&self, name: &str, kind: u8, value: &[u8]) -> Vec<u8> {
        let body = [&[kind, 0], value, &[0]].concat();
        self.entry(name, 1, &body)
    }
}

fn parameters(out: &Out, trial: &Trial, scale: f32) -> Vec<u8> {
    let code = match out.processor {
        Processor::Intel => 84,
        Processor::Dec => 85,
        Processor::Mips => 86,
    };
    let mut entries = vec![out.entry("POINT", -1, &[0])];
    let used = out.word(trial.labels.len() as u16);
    entries.push(out.number("USED", 2, &used));
    entries.push(out.number("FRAMES", 2, &out.word(trial.frames.len() as u16)));
    entries.push(out.number("SCALE", 4, &out.real(scale)));
    entries.push(out.number("RATE", 4, &out.real(trial.rate_hz)));
    let units = [trial.units.clone()];
    entries.push(out.texts("UNITS", &units));
    for (nth, labels) in trial.labels.chunks(255).enumerate() {
        let name = match nth {
            0 => "LABELS".to_owned(),
            _ => format!("LABELS{}", nth + 1),
        };
        entries.push(out.texts(&name, labels));
    }
    let body: Vec<u8> = entries.concat();
    let n_blocks = (body.len() + 6).div_ceil(512);
    let mut section = vec![1, 0x50, n_blocks as u8, code];
    section.extend(body);
    section.extend([0, 0]);
    section
}
