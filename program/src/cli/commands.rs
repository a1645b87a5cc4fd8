//! In: the arguments of the command line. Out: their subcommand, executed; its exit code.
//! Frame and unit: none.

use super::capture::{camera, record};
use super::doctor::command as doctor;
use super::find::{batch, filter, ghost, import_map, locate as find, matching, model, program, second_look, teach};
use super::insert::{guide, job, robot, sweep};
use super::terminal::console::Console;
use super::terminal::threads;
use super::{
    bench, board, calibrate, cell, demo, live, range, rig, ros, scan, scan_profiles, shift_scan, simulate, station,
    verify,
};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use sheetlight::fault::Result;

/// Laser-line scanning with a robot: calibrate, scan, find, insert
///
/// Data goes to stdout, messages to stderr. Exit code 0: done; 1: failed or refused; 2: wrong use.
#[derive(Parser)]
#[command(name = "sheetlight", version, max_term_width = 100, disable_help_flag = true)]
#[command(
    after_help = "To try it: sheetlight demo. Your own rig: docs/getting-started.md. More: sheetlight help COMMAND"
)]
struct Cli {
    /// Print the result as JSON on stdout
    #[arg(long, global = true, display_order = 900)]
    json: bool,
    /// No progress bars and no messages; results are still printed
    #[arg(long, global = true, display_order = 901)]
    quiet: bool,
    /// Print help that fits a screen
    #[arg(short, long, global = true, display_order = 902, action = clap::ArgAction::HelpShort)]
    help: Option<bool>,
    #[command(subcommand)]
    command: Command,
}

/// The commands in the groups of the help.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Station and calibration", &["rig", "station", "board", "calibrate", "verify", "doctor"]),
    ("Scan", &["camera", "record", "live", "scan", "scan-profiles", "shift-scan", "filter", "range", "batch", "mcap"]),
    ("Find", &["teach", "model", "find", "second-look", "ghost", "match", "import-map"]),
    ("Robot", &["sweep", "job", "guide", "program", "robot"]),
    ("Simulation and measurement", &["demo", "simulate", "cell", "bench"]),
];

/// The command line with its commands in groups, which clap does not support directly.
fn grouped() -> clap::Command {
    let command = Cli::command();
    let mut list = String::new();
    for (title, names) in GROUPS {
        list += &format!("{title} commands:\n");
        for name in names {
            let about = command.find_subcommand(name).and_then(clap::Command::get_about);
            list += &format!("  {name:13} {}\n", about.map(ToString::to_string).unwrap_or_default());
        }
    }
    let template =
        format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}Options:\n{{options}}{{after-help}}");
    command.help_template(template)
}

#[derive(Subcommand)]
enum Command {
    Batch(batch::Args),
    Bench(bench::Args),
    Board(board::Args),
    /// Calibrate camera, hand-eye, laser plane, pointer or an axis from recordings
    #[command(subcommand)]
    Calibrate(calibrate::Command),
    /// List cameras, show and set features, take a picture, set the exposure
    #[command(subcommand)]
    Camera(camera::Command),
    /// A simulated robot cell
    #[command(subcommand)]
    Cell(cell::Command),
    Demo(demo::Args),
    Doctor(doctor::Args),
    Filter(filter::Args),
    Find(find::Args),
    Ghost(ghost::Args),
    Guide(guide::Args),
    ImportMap(import_map::Args),
    Job(job::Args),
    Live(live::Args),
    Match(matching::Args),
    Mcap(ros::Args),
    Model(model::Args),
    Program(program::Args),
    Range(range::Args),
    Record(record::Args),
    /// Compute what a planned rig will resolve
    #[command(subcommand)]
    Rig(rig::Command),
    /// Answer a robot's own program; test the outputs of a linked robot
    #[command(subcommand)]
    Robot(robot::Command),
    Scan(scan::Args),
    ScanProfiles(scan_profiles::Args),
    SecondLook(second_look::Args),
    ShiftScan(shift_scan::Args),
    /// Simulate a station with known truth: recordings, poses, true calibration
    Simulate(simulate::Args),
    /// Make, show and change station folders; serve the operator's screen
    #[command(subcommand)]
    Station(station::Command),
    Sweep(sweep::Args),
    Teach(teach::Args),
    Verify(verify::Args),
}

fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Batch(a) => batch::run(a, console),
        Command::Bench(a) => bench::run(a, console),
        Command::Board(a) => board::run(a, console),
        Command::Calibrate(c) => calibrate::run(c, console),
        Command::Camera(c) => camera::run(c, console),
        Command::Cell(c) => cell::run(c, console),
        Command::Demo(a) => demo::run(a, console),
        Command::Doctor(a) => doctor::run(a, console),
        Command::Filter(a) => filter::run(a, console),
        Command::Find(a) => find::run(a, console),
        Command::Ghost(a) => ghost::run(a, console),
        Command::Guide(a) => guide::run(a, console),
        Command::ImportMap(a) => import_map::run(a, console),
        Command::Job(a) => job::run(a, console),
        Command::Live(a) => live::run(a, console),
        Command::Match(a) => matching::run(a, console),
        Command::Mcap(a) => ros::run(a, console),
        Command::Model(a) => model::run(a, console),
        Command::Program(a) => program::run(a, console),
        Command::Range(a) => range::run(a, console),
        Command::Record(a) => record::run(a, console),
        Command::Rig(c) => rig::run(c, console),
        Command::Robot(c) => robot::run(c, console),
        Command::Scan(a) => scan::run(a, console),
        Command::ScanProfiles(a) => scan_profiles::run(a, console),
        Command::SecondLook(a) => second_look::run(a, console),
        Command::ShiftScan(a) => shift_scan::run(a, console),
        Command::Simulate(a) => simulate::run(a, console),
        Command::Verify(a) => verify::run(a, console),
        Command::Station(c) => station::run(c, console),
        Command::Sweep(a) => sweep::run(a, console),
        Command::Teach(a) => teach::run(a, console),
    }
}

/// Parses the command line, runs it, prints an error if there is one. Returns the exit code.
pub fn main() -> u8 {
    let cli = match grouped().try_get_matches().and_then(|m| Cli::from_arg_matches(&m)) {
        Ok(cli) => cli,
        Err(e) => {
            // If even stderr is closed, nothing can be reported.
            let _ = e.print();
            return if e.use_stderr() { 2 } else { 0 };
        }
    };
    let console = Console::new(cli.json, cli.quiet);
    let done = threads::start().and_then(|()| run(&cli.command, &console));
    match done.and_then(|()| console.finish()) {
        Ok(()) => 0,
        Err(fault) => {
            console.fault(&fault);
            fault.exit_code()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The commands that a text shows: its lines, joined where a backslash ends them, from each `sheetlight` on.
    fn shown(text: &str, mark: &str) -> Vec<String> {
        let joined = text.replace("\\\n", " ");
        let calls = joined.lines().filter_map(|l| l.strip_prefix(mark)).filter_map(|l| l.split_once("sheetlight "));
        calls.map(|(_, c)| c.split(['>', '#']).next().unwrap_or_default().trim().to_owned()).collect()
    }

    /// The words as a shell splits them: quotes preserve blanks.
    fn words(call: &str) -> Vec<String> {
        let mut all: Vec<String> = Vec::new();
        for (i, part) in call.split('\'').enumerate() {
            if i % 2 == 1 {
                all.push(part.to_owned());
            } else {
                all.extend(part.split_whitespace().map(str::to_owned));
            }
        }
        all
    }

    fn parses(call: &str) {
        let typed = std::iter::once("sheetlight".to_owned()).chain(words(call));
        let parsed = Cli::try_parse_from(typed);
        assert!(parsed.is_ok(), "sheetlight {call}\n{}", parsed.err().map(|e| e.to_string()).unwrap_or_default());
    }

    fn check(command: &clap::Command) -> usize {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let wide = help.lines().find(|l| l.len() > 98);
        assert!(wide.is_none(), "{}: wraps in the help: {wide:?}", command.get_name());
        let calls = shown(&help, "  ");
        calls.iter().for_each(|c| parses(c));
        calls.len() + command.get_subcommands().map(check).sum::<usize>()
    }

    #[test]
    fn every_command_that_help_and_documents_show_can_be_typed() {
        let command = Cli::command();
        assert!(check(&command) > 20);
        let root = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let guides = std::fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
        let pages = guides.chain([root.join("README.md"), root.join("docs/robots/README.md")]);
        let mut count = 0;
        for page in pages.filter(|p| p.extension().is_some_and(|e| e == "md")) {
            let text = std::fs::read_to_string(&page).unwrap();
            let text = text.lines().map(str::trim_start).collect::<Vec<_>>().join("\n");
            for call in shown(&text, "$ ") {
                println!("{}: {call}", page.display());
                parses(&call);
                count += 1;
            }
            // Within a sentence commands may be shortened, but every named command or option has to exist.
            for call in text.split('`').skip(1).step_by(2).filter_map(|code| code.strip_prefix("sheetlight ")) {
                let typed = std::iter::once("sheetlight".to_owned()).chain(words(call));
                let kind = Cli::try_parse_from(typed).err().map(|e| e.kind());
                let unknown = [clap::error::ErrorKind::UnknownArgument, clap::error::ErrorKind::InvalidSubcommand];
                assert!(!kind.is_some_and(|k| unknown.contains(&k)), "{}: sheetlight {call}", page.display());
            }
        }
        assert!(count > 60, "{count} commands in documents");
        // Every option and argument has a description.
        fn described(command: &clap::Command) {
            for a in command.get_arguments() {
                assert!(a.get_help().is_some(), "{} {} has no help", command.get_name(), a.get_id());
            }
            command.get_subcommands().for_each(described);
        }
        described(&command);
    }

    #[test]
    fn the_help_lists_every_command_once() {
        let mut listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let mut known: Vec<String> = Cli::command().get_subcommands().map(|c| c.get_name().to_owned()).collect();
        listed.sort_unstable();
        known.sort();
        assert_eq!(listed, known);
        let help = grouped().render_help().to_string();
        for line in help.lines() {
            assert!(line.chars().count() <= 100, "wraps: {line}");
        }
        assert!(help.contains("\n  second-look   Plan a verification scan"), "{help}");
    }

    #[test]
    fn a_station_is_named_by_its_option_everywhere() {
        for verb in ["new", "show", "export --out x.json"] {
            let call = format!("sheetlight station {verb} cell3");
            let said = Cli::try_parse_from(call.split_whitespace()).err().expect("no place for it").to_string();
            assert!(said.contains("'cell3'") && said.contains("--station <STATION>"), "{said}");
        }
    }
}
