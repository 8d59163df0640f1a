//! `parallax view`: serves a web page about a running deployment, a finished run, or a recording.

use core::net::{IpAddr, SocketAddr};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::load;
use runtime::{Namespace, deployments};
use serde_json::json;
use terminal::{Globals, output};
use view::{Listen, Options, Subject};

/// Minimum length of a token, in characters.
const SHORTEST_TOKEN: usize = 16;

/// Options of `parallax view`.
#[derive(Debug, Args)]
#[command(after_help = "\
The page shows the skeleton in space with its uncertainty, every camera's picture with the detected pose, epipolar \
lines of a joint or a point, rates and latency, missing processes, and events. A button records into the \
results folder. No process of the deployment waits for the page, which skips frames when it is slow. \
You can open and close pages at any time, also several at once. A page waits for a deployment that does not run yet, and \
for the next run when a run ends. For a finished run, the page has a time line.

By default, the page is only available on this machine (on the loopback), and pages of other sites cannot read it. Other users of this machine can read it, \
unless --token or --token-file is given. Only your own pages, or pages with the token, can record. A recording ends when the page that started it is closed. With \
--listen 0.0.0.0, other machines can also read the page. They need a token, which is created if you give none. Nothing is encrypted: \
over a shared network, prefer a tunnel (`ssh -L 7878:localhost:7878 HOST`).

Press ? in the page for a list of its keys. Ctrl-C ends the view, but not the deployment.

Examples:
    parallax view                        the only running deployment
    parallax view my.toml                the deployment of this file, now or when it runs
    parallax view out/                   a finished run, by its folder
    parallax view run.mcap               a recording
    parallax run my.toml --view          a run and its page together
    parallax view --port 0 --json        any free port; the address as JSON")]
pub(crate) struct Arguments {
    /// A deployment (name or .toml file), the folder of a finished run, or a recording (.mcap). May be left out if
    /// only one deployment is running.
    subject: Option<String>,
    /// Name of a deployment, even if a folder has the same name.
    #[arg(long, value_name = "NAME", conflicts_with = "subject")]
    deployment: Option<String>,
    /// Port of the page, or 0 for any free port. If not given, 7878, or a free port if 7878 is in use.
    #[arg(long, value_name = "N")]
    port: Option<u16>,
    /// Address to listen on. Any address except the loopback needs a token.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,
    /// Require a random token from browsers. The printed address of the page contains it.
    #[arg(long, conflicts_with = "token_file")]
    token: bool,
    /// File with the token that browsers must send: at least 16 letters, digits, '-' or '_'.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Maximum number of pictures per camera and second.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=60))]
    pictures: u32,
    /// Print the address of the page as JSON.
    #[arg(long)]
    json: bool,
    /// End when the parent process ends or closes standard input.
    #[arg(long, hide = true)]
    with_parent: bool,
}

/// Serves the page until Ctrl-C.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let subject = match &arguments.deployment {
        Some(name) => Subject::Deployment(Some(name.clone())),
        None => subject(arguments.subject.as_deref())?,
    };
    let token = match &arguments.token_file {
        Some(file) => Some(token_in(file)?),
        None if arguments.listen.is_loopback() && !arguments.token => None,
        None => Some(random_token()?),
    };
    let options = Options {
        subject,
        listen: Listen {
            address: SocketAddr::new(arguments.listen, arguments.port.unwrap_or(Listen::PORT)),
            may_move: arguments.port.is_none(),
            token,
        },
        pictures_per_second: arguments.pictures,
    };
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    if arguments.with_parent {
        end_with_parent(&stop)?;
    }
    let mut failed = Ok(());
    view::run(&options, &stop, &mut |url| {
        if arguments.port.is_none() && !url.contains(&format!(":{}/", Listen::PORT)) {
            let usual = Listen::PORT;
            output::message(format_args!("port {usual} is in use: using another port"));
        }
        if arguments.with_parent {
            output::message(format_args!("the page: {url}"));
        } else if arguments.json {
            failed = output::json(&json!({ "schema_version": 1, "url": url }));
        } else if !globals.quiet {
            failed = output::line(format_args!(
                "open {url} in a browser; Ctrl-C ends the view"
            ));
        }
    })?;
    failed?;
    Ok(ExitCode::SUCCESS)
}

/// Starts the web page of a deployment's run in a separate process, for the option `--view`.
///
/// * `name`: name of the deployment.
pub(crate) fn beside(name: &str) -> Result<view::Companion, Failure> {
    let executable = std::env::current_exe().or_fail(ExitKind::Run)?;
    view::Companion::start(&executable, name)
}

/// Returns the deployment, folder or recording that an argument names.
fn subject(named: Option<&str>) -> Result<Subject, Failure> {
    let Some(named) = named else {
        return Ok(Subject::Deployment(None));
    };
    let path = Path::new(named);
    let ends_with = |ending: &str| path.extension().is_some_and(|extension| extension == ending);
    if ends_with("toml") {
        let name = load::read(path, &[])?.deployment.name;
        return Ok(Subject::Deployment(Some(name)));
    }
    if ends_with("mcap") {
        return Ok(Subject::Recording(PathBuf::from(named)));
    }
    if path.is_dir() && !runs(named)? {
        return Ok(Subject::Folder(PathBuf::from(named)));
    }
    if named.contains('/') && !path.exists() {
        let text = format!("{named} does not exist");
        return Err(Failure::new(ExitKind::Input, text));
    }
    if path.is_file() {
        let text = format!("{named} is neither a deployment (.toml) nor a recording (.mcap)");
        return Err(Failure::new(ExitKind::Usage, text));
    }
    Namespace::new(named).or_fail(ExitKind::Usage)?;
    if !path.exists() && !runs(named)? {
        output::message(format_args!(
            "no folder, file or running deployment has the name {named}: waiting for a deployment with this name"
        ));
    }
    Ok(Subject::Deployment(Some(named.to_owned())))
}

/// Returns true if a deployment of this name is running.
fn runs(name: &str) -> Result<bool, Failure> {
    let all = deployments(&Namespace::usual_base())?;
    let mut running = all.iter().filter(|deployment| deployment.supervisor.is_some());
    Ok(running.any(|deployment| deployment.namespace.name() == name))
}

/// Reads a token from a file, and removes white space around it.
fn token_in(file: &Path) -> Result<String, Failure> {
    let text = failure::read_text(file)?;
    let token = text.trim();
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
    if token.len() < SHORTEST_TOKEN || !token.bytes().all(is_plain) {
        let text = format!(
            "{}: a token consists of at least {SHORTEST_TOKEN} letters, digits, '-' or '_', and nothing else",
            file.display()
        );
        return Err(Failure::new(ExitKind::Usage, text));
    }
    Ok(token.to_owned())
}

/// Returns 128 random bits as hexadecimal digits.
fn random_token() -> Result<String, Failure> {
    let mut bytes = [0; 16];
    let source = Path::new("/dev/urandom");
    let read = File::open(source).and_then(|mut file| file.read_exact(&mut bytes));
    read.map_err(|error| failure::in_file(source, &error))?;
    let digits = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
    let digits = digits.filter_map(|digit| char::from_digit(digit.into(), 16));
    Ok(digits.collect())
}

/// Requests a stop when standard input ends.
fn end_with_parent(stop: &Stop) -> Result<(), Failure> {
    let stop = stop.clone();
    let wait = move || {
        // An error also means that the parent process has ended.
        let _ended = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        stop.request();
    };
    let thread = std::thread::Builder::new().name("parent".to_owned());
    thread.spawn(wait).or_fail(ExitKind::Run)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_long_and_have_only_plain_characters() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("token");
        let token = |text: &str| {
            std::fs::write(&file, text).unwrap();
            token_in(&file)
        };
        assert_eq!(token("0123456789abcdef\n").unwrap(), "0123456789abcdef");
        for wrong in ["", "short", "0123456789abcde&", "0123456789 abcdef"] {
            assert!(token(wrong).is_err(), "{wrong}");
        }
        let (one, other) = (random_token().unwrap(), random_token().unwrap());
        token(&one).unwrap();
        assert_ne!(one, other);
    }

    #[test]
    fn the_argument_is_recognised_as_a_recording_a_folder_or_a_deployment() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_str().unwrap();
        let got = subject(Some(path)).unwrap();
        assert_eq!(got, Subject::Folder(folder.path().to_owned()));
        let got = subject(Some("a/b.mcap")).unwrap();
        assert_eq!(got, Subject::Recording("a/b.mcap".into()));
        let got = subject(Some("no-such-run")).unwrap();
        assert_eq!(got, Subject::Deployment(Some("no-such-run".to_owned())));
        assert_eq!(subject(Some("a/b")).unwrap_err().kind(), ExitKind::Input);
        assert_eq!(subject(None).unwrap(), Subject::Deployment(None));
    }
}
