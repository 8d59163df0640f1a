//! Sets a device to a format, a size and a rate that it offers.

use super::device::rate_hz;
use super::raw;
use super::{FourCc, VideoDevice, VideoError, VideoFormat, VideoMode, VideoSize, VideoWish};

impl VideoDevice {
    /// Sets format, size and rate. Returns the resulting mode of the device.
    ///
    /// # Errors
    ///
    /// Returns [`VideoError::NotOffered`] with the offered choices if the device does not accept a value, or [`VideoError::Request`].
    pub fn set(&self, wish: &VideoWish) -> Result<VideoMode, VideoError> {
        let offered = self.formats()?;
        let now = self.mode()?;
        let has = |four_cc: &FourCc| offered.iter().any(|offer| offer.format == *four_cc);
        let format = match &wish.formats[..] {
            [] => now.format,
            wanted => *wanted.iter().find(|format| has(format)).ok_or_else(|| {
                let names: Vec<String> = wanted.iter().map(ToString::to_string).collect();
                self.not_offered("format", names.join(" or "), names_of(&offered))
            })?,
        };
        let size = wish.size.unwrap_or_else(|| {
            let own = offered.iter().find(|offer| offer.format == format);
            own.and_then(|offer| offer.nearest(now.size)).unwrap_or(now.size)
        });
        self.set_format(format, size, &offered)?;
        if let Some(rate) = wish.rate_hz {
            self.set_rate(rate, format, size, &offered)?;
        }
        self.mode()
    }

    fn set_format(
        &self,
        format: FourCc,
        size: [u32; 2],
        offered: &[VideoFormat],
    ) -> Result<(), VideoError> {
        let mut set = raw::Format {
            width: size[0],
            height: size[1],
            pixels: format.number(),
            ..raw::Format::default()
        };
        self.ask(raw::S_FMT, "take a format", &mut set)?;
        if set.pixels != format.number() {
            return Err(self.not_offered("format", format.to_string(), names_of(offered)));
        }
        if [set.width, set.height] != size {
            let sizes = offered.iter().filter(|offered| offered.format == format);
            let sizes: Vec<String> =
                sizes.flat_map(|size| &size.sizes).map(VideoSize::text).collect();
            let wanted = format!("{}x{} in {format}", size[0], size[1]);
            return Err(self.not_offered("size", wanted, sizes.join(", ")));
        }
        Ok(())
    }

    /// Sets the nearest rate, which may differ by up to 2 %: for example, 29.97 instead of 30.
    fn set_rate(
        &self,
        rate: f64,
        format: FourCc,
        size: [u32; 2],
        offered: &[VideoFormat],
    ) -> Result<(), VideoError> {
        const TOLERANCE: f64 = 0.02;
        let mut parameters = raw::StreamParameters {
            numerator: 1_000_000,
            denominator: (rate * 1e6).round() as u32,
            ..raw::StreamParameters::default()
        };
        let asked = raw::ask(self.fd(), raw::S_PARM, &mut parameters);
        let set = rate_hz([parameters.numerator, parameters.denominator]);
        let fits = |value: f64| (value / rate - 1.0).abs() <= TOLERANCE;
        if asked.is_ok() && set.is_some_and(fits) {
            return Ok(());
        }
        let own = offered.iter().find(|offer| offer.format == format);
        let rates = own.map_or_else(Vec::new, |offer| offer.rates_at(size));
        let rates: Vec<String> = rates.iter().map(|rate| format!("{rate:.2}")).collect();
        let offered = if rates.is_empty() {
            set.map_or_else(|| "no choice".to_owned(), |set| format!("{set:.2}"))
        } else {
            rates.join(", ")
        };
        let wanted = format!(
            "{rate} pictures per second at {}x{} in {format}",
            size[0], size[1]
        );
        Err(self.not_offered("rate", wanted, offered))
    }

    fn not_offered(&self, what: &'static str, wanted: String, offered: String) -> VideoError {
        VideoError::NotOffered {
            path: self.path().to_owned(),
            what,
            wanted,
            offered,
        }
    }
}

fn names_of(offered: &[VideoFormat]) -> String {
    let names: Vec<String> = offered.iter().map(|offered| offered.format.to_string()).collect();
    names.join(", ")
}
