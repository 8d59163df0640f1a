//! The exit codes of commands, for users and scripts.

/// The table of exit codes in `--help`.
pub const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  the run failed
    2  the command line is wrong
    3  a deployment or settings file is wrong
    4  an input is missing or unreadable (footage, model, calibration file, table, data set)
    5  the calibration cannot be used
    6  a limit was missed (`demo`, `chaos`, a latency budget)
    7  done, but degraded: views, frames or processes were lost during the run
  130  stopped by Ctrl-C

Data goes to standard output, messages and progress to standard error.";

#[cfg(test)]
mod tests {
    use failure::ExitKind;

    use super::*;

    #[test]
    fn every_exit_code_is_in_the_help() {
        for kind in ExitKind::ALL {
            let line = format!("{:>5}  ", kind.status());
            assert!(EXIT_CODES.contains(&line), "{kind:?}");
        }
    }
}
