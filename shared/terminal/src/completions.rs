//! `parallax completions` and `parallax man`: write shell completions and manual pages, generated from the tree of commands.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::output;
use clap::{Args, Command};
use clap_complete::Shell;
use failure::{ExitKind, Failure, OrFail as _, in_file};

/// Options of `parallax completions`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
    parallax completions bash > ~/.local/share/bash-completion/completions/parallax
    parallax completions zsh > ~/.zfunc/_parallax
    parallax completions fish > ~/.config/fish/completions/parallax.fish")]
pub struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the completion script for a shell.
///
/// * `command`: the tree of commands.
///
/// # Errors
///
/// Fails if standard output cannot be written to.
pub fn run(arguments: &Arguments, mut command: Command) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    let name = command.get_name().to_owned();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    io::stdout().write_all(&script).or_fail(ExitKind::Run)?;
    Ok(ExitCode::SUCCESS)
}

/// Options of `parallax man`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
    parallax man ~/.local/share/man/man1        then `man parallax`, `man parallax-run`")]
pub struct ManArguments {
    /// Folder for the pages, one for each command.
    folder: PathBuf,
}

/// Writes the manual pages.
///
/// * `command`: the tree of commands.
///
/// # Errors
///
/// Fails if the folder or a page cannot be written.
pub fn man(arguments: &ManArguments, mut command: Command) -> Result<ExitCode, Failure> {
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder).map_err(|error| in_file(folder, &error))?;
    command.build();
    let n_pages = write_pages(command, folder)?;
    output::line(format_args!("{n_pages} pages in {}", folder.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the pages of a command and its subcommands. Returns the number of pages.
///
/// # Errors
///
/// Fails if a page cannot be written.
pub fn write_pages(command: Command, folder: &Path) -> Result<usize, Failure> {
    let below: Vec<Command> = command.get_subcommands().cloned().collect();
    let name = command.get_display_name().unwrap_or_else(|| command.get_name());
    let file = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page).or_fail(ExitKind::Run)?;
    files::replace(&file, &page).map_err(|error| in_file(&file, &error))?;
    let mut n_pages = 1;
    for command in below {
        if !command.is_hide_set() && command.get_name() != "help" {
            n_pages += write_pages(command, folder)?;
        }
    }
    Ok(n_pages)
}
