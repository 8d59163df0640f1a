//! The command line options.

use kernels::Isa;

use crate::stages::Stage;

/// The parsed options; see `scripts/bench --help`.
#[derive(Debug, Default)]
pub(crate) struct Options {
    pub(crate) quick: bool,
    pub(crate) json: bool,
    pub(crate) record: bool,
    /// The stages to measure; if empty, all stages are measured.
    stages: Vec<String>,
    images: Vec<String>,
    isas: Vec<String>,
    pub(crate) threads: Vec<usize>,
    pub(crate) commit: String,
}

impl Options {
    /// Parses the arguments; the error is a text for the user.
    pub(crate) fn parse(mut args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            commit: "unknown".to_owned(),
            ..Self::default()
        };
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value"));
            match arg.as_str() {
                "--test" => options.quick = true,
                "--json" => options.json = true,
                "--record" => options.record = true,
                "--stage" => options.stages.push(value()?),
                "--image" => options.images.push(value()?),
                "--isa" => options.isas.push(value()?),
                "--threads" => {
                    let n = value()?.parse();
                    options.threads.push(n.map_err(|error| format!("--threads: {error}"))?);
                }
                "--commit" => options.commit = value()?,
                // Cargo passes this option.
                "--bench" => {}
                other => return Err(format!("unknown option {other}: see scripts/bench --help")),
            }
        }
        if options.threads.is_empty() {
            let n = std::thread::available_parallelism().map_or(1, usize::from);
            options.threads = if options.quick {
                vec![1, 2]
            } else {
                vec![1, 2, n]
            };
            options.threads.dedup();
        }
        Ok(options)
    }

    pub(crate) fn wants_stage(&self, stage: Stage) -> bool {
        let name = stage.name();
        self.stages.is_empty() || self.stages.iter().any(|stage| name.starts_with(stage.as_str()))
    }

    pub(crate) fn wants_image(&self, name: &str) -> bool {
        self.images.is_empty() || self.images.iter().any(|image| image == name)
    }

    /// Returns true if an instruction set is to be measured. The portable set is slow without multiply-add instructions, so it is only
    /// measured if it is requested.
    pub(crate) fn wants_isa(&self, isa: Isa) -> bool {
        if self.isas.is_empty() {
            return self.quick || isa.name() != "portable" || Isa::available().len() == 1;
        }
        self.isas.iter().any(|name| name == isa.name())
    }
}
