//! In: the arguments of `sheetlight bench run`, `compare`, `verify`, `html` and `entry`. Out: a benchmark of several
//! programs, its comparison, its page; or this program's own part in it. Frame and unit: ms a picture, px, mm.

use crate::bench::throughput::{
    self, Compared, Entry, Plan, Results, RowOf, Scenario, SceneKind, Task, compare, verify,
};
use crate::cli::terminal::arguments::parse;
use crate::cli::terminal::console::Console;
use sheetlight::fault::{Fault, Result};
use sheetlight::scan::Where;
use std::path::{Path, PathBuf};
use strum::VariantArray;

/// A benchmark of any programs on the same pictures (docs/benchmark.md)
#[derive(clap::Subcommand)]
pub enum Command {
    Run(RunArgs),
    Compare(CompareArgs),
    Verify(VerifyArgs),
    Html(HtmlArgs),
    Entry(EntryArgs),
}

/// Time programs that find a laser stripe, and score their points
///
/// Every program reads the same pictures and writes points. Programs take turns, round by round. Each row has the time
/// and the accuracy of the same pictures.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight bench run --entry 'cpu=sheetlight bench entry --on cpu' --out results.json
  sheetlight bench run --entry 'a=sheetlight bench entry' --entry 'b=./mine' --out r.json
Guide: docs/benchmark.md")]
pub struct RunArgs {
    /// NAME=COMMAND of a program; may be repeated. {scene}, {size}, {bits}, {scenario} in it: open division
    #[arg(long, required = true, value_parser = Entry::parse)]
    entry: Vec<Entry>,
    /// clean, dim, speckle, thick, slanted, two-stripes, reflections, tenth-lit or dark; may be repeated
    /// [default: all]
    #[arg(long, value_parser = parse::<SceneKind>)]
    scene: Vec<SceneKind>,
    /// Picture size, px; may be repeated
    #[arg(long, value_parser = size, default_value = "640x480")]
    size: Vec<(u32, u32)>,
    /// Bits of a pixel, 8 to 16; may be repeated
    #[arg(long, default_value = "8", value_parser = clap::value_parser!(u8).range(8..=16))]
    bits: Vec<u8>,
    /// single, offline, camera or streams; may be repeated
    #[arg(long, default_values = ["single", "offline"], value_parser = parse::<Scenario>)]
    scenario: Vec<Scenario>,
    /// Rounds of every program
    #[arg(long, default_value_t = 9)]
    rounds: usize,
    /// Least duration of a round, s
    #[arg(long, default_value_t = 1.0)]
    seconds: f64,
    /// Pictures a second of scenario camera [default: 60 million pixels a second]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Longest wait for a program's first line, and for the points of a picture, s
    #[arg(long, value_name = "S", default_value_t = 120.0)]
    timeout: f64,
    /// File for the results, JSON
    #[arg(long)]
    out: PathBuf,
}

/// Ratio of two programs' times in one run, with its scatter
///
/// Ratios are of rounds that ran next to each other. Behind the median stands the middle two thirds of the rounds.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight bench compare results.json mine cpu
  sheetlight bench compare results.json new old --at-most 1.25
Guide: docs/benchmark.md")]
pub struct CompareArgs {
    /// Results of sheetlight bench run
    results: PathBuf,
    /// Name of the first program
    first: String,
    /// Name of the second program
    second: String,
    /// Exit code 1 if the first takes more than this times the CPU time of the second in a row, scatter included
    #[arg(long, value_name = "RATIO")]
    at_most: Option<f64>,
}

/// Check results against the rules: pictures, rounds, machine, accuracy
///
/// The pictures are drawn again and their hashes compared. Exit code 1 if something is against the rules.
#[derive(clap::Args)]
#[command(after_help = "Example: sheetlight bench verify results.json\nGuide: docs/benchmark.md")]
pub struct VerifyArgs {
    /// Results of sheetlight bench run
    results: PathBuf,
}

/// One page with the tables of several results
#[derive(clap::Args)]
#[command(after_help = "Example: sheetlight bench html benches/runs/*/throughput.json --out benchmark.html
Guide: docs/benchmark.md")]
pub struct HtmlArgs {
    /// Results of sheetlight bench run
    #[arg(required = true)]
    results: Vec<PathBuf>,
    /// The page
    #[arg(long)]
    out: PathBuf,
}

/// Take part in a benchmark: pictures on stdin, points on stdout
#[derive(clap::Args)]
#[command(after_help = "Guide: docs/benchmark.md")]
pub struct EntryArgs {
    /// auto, gpu or cpu
    #[arg(long, default_value = "auto", conflicts_with = "nothing")]
    on: Where,
    /// Read the pictures and return no points: what the pipe takes
    #[arg(long)]
    nothing: bool,
}

/// WIDTHxHEIGHT, px.
pub(super) fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let both = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    both.ok_or_else(|| format!("'{text}' is not WIDTHxHEIGHT"))
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    match command {
        Command::Run(args) => drive(args, console),
        Command::Compare(args) => compared(args, console),
        Command::Verify(args) => verified(args, console),
        Command::Html(args) => {
            let name = |p: &PathBuf| {
                let folder = p.parent().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned());
                let file = p.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
                folder.map_or_else(|| file.clone(), |folder| format!("{folder}/{file}"))
            };
            let runs = args.results.iter().map(|p| Ok((name(p), Results::read(p)?))).collect::<Result<Vec<_>>>()?;
            sheetlight::files::write(&args.out, throughput::page(&runs).as_bytes())?;
            console.result(&serde_json::json!({"page": args.out}), &args.out.display().to_string());
            Ok(())
        }
        Command::Entry(args) => {
            let input = std::io::BufReader::with_capacity(1 << 20, std::io::stdin());
            throughput::serve(args.on, args.nothing, input, std::io::stdout().lock())
        }
    }
}

fn drive(args: &RunArgs, console: &Console) -> Result<()> {
    let scenes = if args.scene.is_empty() { SceneKind::VARIANTS } else { &args.scene };
    let mut tasks = Vec::new();
    for &(width, height) in &args.size {
        if ![width, height].iter().all(|side| (64..=8192).contains(side)) {
            let what = format!("a picture of {width}x{height} px, 64 to 8192 a side are possible");
            return Err(Fault::usage(what).next("correct --size"));
        }
        for &bits in &args.bits {
            tasks.extend(scenes.iter().map(|&scene| Task { scene, width, height, bits }));
        }
    }
    let plan = Plan {
        entries: args.entry.clone(),
        tasks,
        scenarios: args.scenario.clone(),
        rounds: args.rounds,
        seconds: args.seconds,
        rate_hz: args.rate,
        timeout_s: args.timeout,
    };
    let turns = plan.entries.len() * (plan.rounds + 1) * plan.tasks.len() * plan.scenarios.len();
    let bar = console.bar("", turns as u64);
    let results = throughput::run(&plan, |turn| {
        bar.set_message(turn.to_owned());
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let json = serde_json::to_string_pretty(&results).expect("plain data");
    sheetlight::files::write(&args.out, json.as_bytes())?;
    console.result(&results, &table(&results));
    let failed: Vec<&RowOf> = results.rows.iter().filter(|r| r.failed.is_some()).collect();
    let Some(first) = failed.first() else { return Ok(()) };
    let what = format!("{} of {} rows have no result; the first: {}", failed.len(), results.rows.len(), first.entry);
    Err(Fault::refused(format!("{what}, {}: {}", first.task.name(), first.failed.as_deref().unwrap_or_default()))
        .cause("the program stopped, or its replies are not in the format of docs/benchmark.md")
        .next("compare what it reads and writes with that document; the other rows are stored"))
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "-".into(), |v| format!("{v:.digits$}"))
}

/// One line for each row of the results.
fn table(results: &Results) -> String {
    let mut out = format!(
        "{:30} {:9} {:14} {:>9} {:>9} {:>8} {:>7} {:>9} {:>9} {:>7}\n",
        "pictures", "scenario", "entry", "ms", "CPU ms", "p99 ms", "found", "rms px", "rms mm", "false"
    );
    let line = |r: &RowOf| {
        let a = r.accuracy.as_ref();
        let per_cent = |v: Option<f64>| v.map_or_else(|| "-".into(), |v| format!("{:.1} %", 100.0 * v));
        let mut line = format!(
            "{:30} {:9} {:14} {:>9} {:>9} {:>8} {:>7} {:>9} {:>9} {:>7}",
            r.task.name(),
            r.scenario.name(),
            r.entry,
            number(r.ms(), 3),
            number(r.cpu_ms(), 3),
            number(r.latency_ms().map(|l| l[2]), 3),
            per_cent(a.and_then(|a| a.found)),
            number(a.and_then(|a| a.rms_px), 4),
            number(a.and_then(|a| a.rms_mm), 4),
            per_cent(a.and_then(|a| a.false_share)),
        );
        if r.task.scene == SceneKind::Dark {
            line += &a.map_or_else(String::new, |a| format!("  {:.1} false points a picture", a.false_a_picture));
        }
        if r.scenario == Scenario::Camera {
            line += &format!("  dropped {:.1} % at {:.1}/s", 100.0 * r.dropped(), r.rate_hz.unwrap_or(0.0));
        }
        let against = r.against();
        if !against.is_empty() {
            line += &format!("  does not count: {}", against.join("; "));
        }
        line + "\n"
    };
    out.extend(results.rows.iter().map(line));
    out.trim_end().to_owned()
}

fn compared(args: &CompareArgs, console: &Console) -> Result<()> {
    if args.at_most.is_some_and(|r| !(0.01..=1000.0).contains(&r)) {
        return Err(Fault::usage("--at-most: 0.01 to 1000 are possible".to_owned()).next("correct the option"));
    }
    let results = Results::read(&args.results)?;
    let rows = compare(&results, &args.first, &args.second)?;
    let with = |value: Option<f64>, scatter: Option<[f64; 2]>| {
        value.zip(scatter).map_or_else(|| "-".into(), |(v, [a, b])| format!("{v:.3} ({a:.3} to {b:.3})"))
    };
    let line = |r: &Compared| {
        let rms = r.accuracy.map(|a| number(a.and_then(|a| a.rms_px), 4));
        format!(
            "{:30} {:9} {:>24} {:>24} {:>8} {:>8}  {}",
            r.task.name(),
            r.scenario.name(),
            with(r.wall, r.wall_scatter),
            with(r.cpu, r.cpu_scatter),
            rms[0],
            rms[1],
            r.against.join("; ")
        )
    };
    let head = format!(
        "{} / {}\n{:30} {:9} {:>24} {:>24} {:>8} {:>8}",
        args.first, args.second, "pictures", "scenario", "time", "CPU time", "rms px", "rms px"
    );
    let text = std::iter::once(head).chain(rows.iter().map(|r| line(r).trim_end().to_owned())).collect::<Vec<_>>();
    console.result(&rows, &text.join("\n"));
    let Some(limit) = args.at_most else { return Ok(()) };
    let named = |rows: &[&Compared]| {
        rows.iter().map(|r| format!("{}, {}", r.task.name(), r.scenario.name())).collect::<Vec<_>>().join("; ")
    };
    // The lower end of the scatter: a row fails only if nearly all rounds are above the limit.
    let slower: Vec<&Compared> = rows.iter().filter(|r| r.cpu_scatter.is_some_and(|[low, _]| low > limit)).collect();
    if !slower.is_empty() {
        let what = format!("{} takes more than {limit} times the CPU time of {}", args.first, args.second);
        return Err(Fault::refused(format!("{what}: {}", named(&slower)))
            .cause("the first program became slower")
            .next("look at the rows above, and run again on a quiet machine"));
    }
    let without: Vec<&Compared> = rows.iter().filter(|r| r.cpu.is_none()).collect();
    if rows.is_empty() || !without.is_empty() {
        let what = if rows.is_empty() { "no row has both programs".into() } else { named(&without) };
        return Err(Fault::refused(format!(
            "no ratio of CPU times in {} of {} rows: {what}",
            without.len(),
            rows.len()
        ))
        .cause("one of the programs failed there, has too few or too wrong points, or the system counts no CPU time")
        .next("the reason stands behind each row"));
    }
    Ok(())
}

fn verified(args: &VerifyArgs, console: &Console) -> Result<()> {
    let results = Results::read(&args.results)?;
    let bar = console.bar("pictures", results.rows.len() as u64);
    let found = verify(&results, |task| {
        bar.set_message(task.to_owned());
        bar.inc(1);
    });
    bar.finish_and_clear();
    if found.is_empty() {
        let text = format!(
            "{}: {} rows, no breach of the rules that can be checked",
            args.results.display(),
            results.rows.len()
        );
        console.result(&serde_json::json!({"against": found}), &text);
        return Ok(());
    }
    console.result(&serde_json::json!({"against": found}), &found.join("\n"));
    Err(Fault::refused(format!("{}: {} breaches of the rules", args.results.display(), found.len()))
        .cause("each line above names one")
        .next("run all scenes with nine rounds of one second on a quiet machine"))
}
