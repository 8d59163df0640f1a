//! Capabilities of a device: formats, sizes, rates, controls.

use super::device::{rate_hz, text};
use super::raw::{self, QueryControl};
use super::{FourCc, VideoDevice, VideoError};

/// Maximum number of entries of any list that is requested from a driver. Without a limit, a driver could send entries forever.
const MOST: u32 = 1024;

/// A format with its sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoFormat {
    /// Letters of the format.
    pub format: FourCc,
    /// Name of the format in the driver.
    pub description: String,
    /// Sizes that the format offers.
    pub sizes: Vec<VideoSize>,
}

/// A size, or a range of sizes, with its rates.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoSize {
    /// Minimum width and height, in pixels.
    pub least: [u32; 2],
    /// Maximum width and height, in pixels. Equal to `least` for a single size.
    pub most: [u32; 2],
    /// Pictures per second, the fastest first. For a range of rates, these are its two ends.
    pub rates_hz: Vec<f64>,
}

impl VideoSize {
    /// Returns a text such as `640x480` or `16x16 to 1920x1080`.
    pub fn text(&self) -> String {
        let [least, most] = [self.least, self.most].map(|[w, h]| format!("{w}x{h}"));
        if self.least == self.most {
            least
        } else {
            format!("{least} to {most}")
        }
    }

    fn has(&self, size: [u32; 2]) -> bool {
        let fits = |axis: usize| (self.least[axis]..=self.most[axis]).contains(&size[axis]);
        fits(0) && fits(1)
    }
}

impl VideoFormat {
    /// Returns the size itself if it is offered, otherwise the largest offered size.
    pub(super) fn nearest(&self, size: [u32; 2]) -> Option<[u32; 2]> {
        if self.sizes.iter().any(|range| range.has(size)) {
            return Some(size);
        }
        let all = self.sizes.iter().map(|size| size.most);
        all.max_by_key(|size| u64::from(size[0]) * u64::from(size[1]))
    }

    pub(super) fn rates_at(&self, size: [u32; 2]) -> Vec<f64> {
        let own = self.sizes.iter().find(|range| range.has(size));
        own.map_or_else(Vec::new, |range| range.rates_hz.clone())
    }
}

/// A setting of a camera: a number, a switch or a choice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VideoControl {
    /// Number of the control in the kernel.
    pub id: u32,
    /// Name of the control in a deployment file, such as `exposure_time_absolute`.
    pub name: String,
    /// Minimum, maximum and step of the value.
    pub range: [i32; 3],
    /// Default value.
    pub default: i32,
    /// Current value; `None` if it cannot be read.
    pub value: Option<i32>,
    /// Number and name of each choice of a menu.
    pub choices: Vec<(u32, String)>,
    /// True if the control cannot be set at the moment, or not at all.
    pub is_fixed: bool,
}

impl VideoControl {
    /// Returns a text with the values that the control accepts, for users.
    pub fn takes(&self) -> String {
        if self.choices.is_empty() {
            let [least, most, step] = self.range;
            return if step > 1 {
                format!("{least} to {most} in steps of {step}")
            } else {
                format!("{least} to {most}")
            };
        }
        let all = self.choices.iter().map(|(value, name)| format!("{value} ({name})"));
        all.collect::<Vec<_>>().join(", ")
    }

    fn accepts(&self, value: i64) -> bool {
        let [least, most, _] = self.range.map(i64::from);
        let is_choice = |choice: &(u32, String)| i64::from(choice.0) == value;
        (least..=most).contains(&value)
            && (self.choices.is_empty() || self.choices.iter().any(is_choice))
    }
}

impl VideoDevice {
    /// Returns the formats of the device with their sizes and rates.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::Request`] if the device reports no formats.
    pub fn formats(&self) -> Result<Vec<VideoFormat>, VideoError> {
        let mut formats = Vec::new();
        for index in 0..MOST {
            let mut it = raw::FormatDescription {
                index,
                kind: raw::VIDEO_CAPTURE,
                ..raw::FormatDescription::default()
            };
            match self.ask(raw::ENUM_FMT, "tell its formats", &mut it) {
                Ok(()) => formats.push(VideoFormat {
                    format: FourCc::of_number(it.pixel_format),
                    description: text(&it.description),
                    sizes: self.sizes(it.pixel_format),
                }),
                Err(error) if formats.is_empty() => return Err(error),
                Err(_end) => break,
            }
        }
        Ok(formats)
    }

    fn sizes(&self, pixel_format: u32) -> Vec<VideoSize> {
        let mut sizes = Vec::new();
        for index in 0..MOST {
            let mut it = raw::FrameSize {
                index,
                pixel_format,
                ..raw::FrameSize::default()
            };
            if raw::ask(self.fd(), raw::ENUM_FRAMESIZES, &mut it).is_err() {
                break;
            }
            let [a, b, _, d, e, _] = it.numbers;
            let is_one = it.kind == 1;
            let (least, most) = if is_one {
                ([a, b], [a, b])
            } else {
                ([a, d], [b, e])
            };
            sizes.push(VideoSize {
                least,
                most,
                rates_hz: self.rates(pixel_format, most),
            });
            if !is_one {
                break;
            }
        }
        sizes
    }

    fn rates(&self, pixel_format: u32, [width, height]: [u32; 2]) -> Vec<f64> {
        let mut rates = Vec::new();
        for index in 0..MOST {
            let mut it = raw::FrameInterval {
                index,
                pixel_format,
                width,
                height,
                ..raw::FrameInterval::default()
            };
            if raw::ask(self.fd(), raw::ENUM_FRAMEINTERVALS, &mut it).is_err() {
                break;
            }
            let [a, b, c, d, ..] = it.numbers;
            rates.extend(rate_hz([a, b]));
            if it.kind != 1 {
                rates.extend(rate_hz([c, d]));
                break;
            }
        }
        rates
    }

    /// Returns the controls of the device, in the order of the driver.
    pub fn controls(&self) -> Vec<VideoControl> {
        let mut controls = Vec::new();
        let mut last = 0;
        for _ in 0..MOST {
            let mut it = QueryControl {
                id: last | raw::CTRL_FLAG_NEXT_CTRL,
                ..QueryControl::default()
            };
            if raw::ask(self.fd(), raw::QUERYCTRL, &mut it).is_err() || it.id <= last {
                break;
            }
            last = it.id;
            controls.extend(self.control(&it));
        }
        controls
    }

    fn control(&self, it: &QueryControl) -> Option<VideoControl> {
        /// Numbers of `V4L2_CTRL_TYPE_INTEGER`, `BOOLEAN`, `MENU`, `BUTTON`, `BITMASK`, `INTEGER_MENU`.
        const WITH_NUMBERS: [u32; 6] = [1, 2, 3, 4, 8, 9];
        if it.flags & raw::CTRL_FLAG_DISABLED != 0 || !WITH_NUMBERS.contains(&it.kind) {
            return None;
        }
        let mut value = raw::Control {
            id: it.id,
            value: 0,
        };
        let is_read = raw::ask(self.fd(), raw::G_CTRL, &mut value).is_ok();
        let fixed = raw::CTRL_FLAG_READ_ONLY | raw::CTRL_FLAG_INACTIVE;
        Some(VideoControl {
            id: it.id,
            name: as_key(&text(&it.name)),
            range: [it.minimum, it.maximum, it.step],
            default: it.default,
            value: is_read.then_some(value.value),
            choices: self.choices(it),
            is_fixed: it.flags & fixed != 0,
        })
    }

    fn choices(&self, it: &QueryControl) -> Vec<(u32, String)> {
        const MENU: u32 = 3;
        const NUMBERS: u32 = 9;
        if ![MENU, NUMBERS].contains(&it.kind) {
            return Vec::new();
        }
        let range = it.minimum.max(0) as u32..=it.maximum.clamp(0, MOST as i32) as u32;
        let name = |index: u32| {
            let mut menu = raw::QueryMenu {
                id: it.id,
                index,
                ..raw::QueryMenu::default()
            };
            raw::ask(self.fd(), raw::QUERYMENU, &mut menu).ok()?;
            let name = menu.name;
            let [a, b, c, d, e, f, g, h, ..] = name;
            let number = i64::from_ne_bytes([a, b, c, d, e, f, g, h]);
            let is_menu = it.kind == MENU;
            Some((
                index,
                if is_menu {
                    text(&name)
                } else {
                    number.to_string()
                },
            ))
        };
        range.filter_map(name).collect()
    }

    /// Sets a control by its name.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::NoControl`] with the controls that the device has, [`VideoError::Value`] with the values that the control
    /// accepts, or [`VideoError::Request`] if the device refuses.
    pub fn set_control(&self, name: &str, value: i64) -> Result<(), VideoError> {
        let controls = self.controls();
        let Some(control) = controls.iter().find(|control| control.name == name) else {
            let names: Vec<&str> = controls.iter().map(|control| control.name.as_str()).collect();
            let offered = if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            };
            return Err(VideoError::NoControl {
                path: self.path().to_owned(),
                name: name.to_owned(),
                offered,
            });
        };
        if !control.accepts(value) {
            return Err(VideoError::Value {
                path: self.path().to_owned(),
                name: name.to_owned(),
                value,
                expected: control.takes(),
            });
        }
        let mut set = raw::Control {
            id: control.id,
            value: value as i32,
        };
        self.ask(raw::S_CTRL, "accept the value of a control", &mut set)
    }
}

/// Converts the driver's name of a control to a key: `Exposure Time, Absolute` becomes `exposure_time_absolute`.
fn as_key(name: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric();
    let words = name.split(|letter| !is_plain(letter)).filter(|part| !part.is_empty());
    words.collect::<Vec<_>>().join("_").to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camera_controls_have_names_that_are_valid_keys() {
        assert_eq!(as_key("Exposure Time, Absolute"), "exposure_time_absolute");
        assert_eq!(
            as_key("White Balance, Automatic"),
            "white_balance_automatic"
        );
    }

    #[test]
    fn control_values_out_of_range_and_unknown_menu_choices_are_refused() {
        let mut control = VideoControl {
            id: 1,
            name: "a".to_owned(),
            range: [0, 3, 1],
            default: 0,
            value: None,
            choices: Vec::new(),
            is_fixed: false,
        };
        assert!(control.accepts(2) && !control.accepts(4) && !control.accepts(i64::MAX));
        assert_eq!(control.takes(), "0 to 3");
        control.choices = vec![(1, "Manual".to_owned()), (3, "Aperture".to_owned())];
        assert!(control.accepts(1) && !control.accepts(2));
        assert_eq!(control.takes(), "1 (Manual), 3 (Aperture)");
    }

    #[test]
    fn the_nearest_size_is_the_requested_one_or_the_largest() {
        let size = |w, h| VideoSize {
            least: [w, h],
            most: [w, h],
            rates_hz: vec![30.0],
        };
        let format = VideoFormat {
            format: FourCc(*b"MJPG"),
            description: String::new(),
            sizes: vec![size(640, 480), size(1280, 720)],
        };
        assert_eq!(format.nearest([640, 480]), Some([640, 480]));
        assert_eq!(format.nearest([100, 100]), Some([1280, 720]));
        assert_eq!(format.rates_at([640, 480]), [30.0]);
    }
}
