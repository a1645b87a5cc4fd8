//! In: sizes and scenes. Out: a table of this machine's speeds, or a file of it; or the peer's side of a comparison
//! on stdin and stdout. Frame and unit: ms, shots/s, pixels, GB/s.

mod entries;

use crate::bench::{self, BenchOptions, KeptUp, Scene, WayTime};
use crate::cli::terminal::console::Console;
use sheetlight::fault::Result;
use sheetlight::gpu::Device;
use sheetlight::scan::Where;
use std::path::{Path, PathBuf};

/// Measure the speed of the stripe chain on this machine
///
/// Every row is one size and one scene. It shows the time per shot in steady state with several batches in flight,
/// and the CPU time. It also shows the share of what memory and upload could carry, the latency of a single shot, and
/// the GPU's time per stage. "resident" is the rate in Mpx/s with the pictures already on the device, "and full" that
/// of the full chain. Below the table stands the time of a shot and of every further megapixel. If all scenes are
/// measured, the time of every further per cent of lit pixels follows.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
#[command(after_help = "Examples:
  sheetlight bench
  sheetlight bench --size 4096x3072 --scene one-stripe --seconds 10
  sheetlight bench --keep-up 30
  sheetlight bench --json --save benches/runs/2026-11-21-desk
Guide: benches/README.md")]
pub struct Args {
    #[command(subcommand)]
    command: Option<entries::Command>,
    /// Picture size, px; may be repeated [default: 640x480, 1280x960, 4096x3072, 5120x5120]
    #[arg(long, value_parser = entries::size)]
    size: Vec<(u32, u32)>,
    /// one-stripe, thick-stripe, upright-stripe, upright-thick, noise-heavy or reflection-heavy; may be repeated
    /// [default: all]
    #[arg(long, value_parser = scene)]
    scene: Vec<Scene>,
    /// Duration of a row, s
    #[arg(long, default_value_t = BenchOptions::default().seconds)]
    seconds: f64,
    /// Shots of a long run of the full chain that checks for growing memory; 0: none
    #[arg(long, default_value_t = 0)]
    soak: usize,
    /// Let a software adapter read arrays from buffers, like other adapters
    #[arg(long)]
    from_buffers: bool,
    /// Instead of the table: how many pictures of a camera of this rate are processed and how many are dropped
    #[arg(long, value_name = "HZ", conflicts_with_all = ["size", "scene", "soak", "from_buffers", "save"])]
    keep_up: Option<f64>,
    /// Folder for bench.json and bench.txt
    #[arg(long)]
    save: Option<PathBuf>,
    /// Serve another program: settings and pictures on stdin, timings and masks on stdout (benches/peers)
    #[arg(long, hide = true)]
    peer_pipe: bool,
}

fn scene(text: &str) -> std::result::Result<Scene, String> {
    let named = |s: &&Scene| s.name().replace(' ', "-") == text;
    Scene::ALL
        .iter()
        .find(named)
        .copied()
        .ok_or_else(|| format!("unknown scene '{text}': {}", Scene::ALL.map(|s| s.name().replace(' ', "-")).join(", ")))
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    if let Some(command) = &args.command {
        return entries::run(command, console);
    }
    if let Some(rate) = args.keep_up {
        return health(rate, args.seconds, console);
    }
    let device = Device::open()?;
    let device = if args.from_buffers { device.without_texels() } else { device };
    if args.peer_pipe {
        return bench::serve(&device, std::io::stdin().lock(), std::io::stdout().lock());
    }
    let mut options = BenchOptions { seconds: args.seconds, soak: args.soak, ..BenchOptions::default() };
    if !args.size.is_empty() {
        options.sizes = args.size.clone();
    }
    if !args.scene.is_empty() {
        options.scenes = args.scene.clone();
        options.lit_shares = false;
    }
    let bar = console.bar("", (options.sizes.len() * options.scenes.len()) as u64);
    let mut begun = 0;
    let report = bench::run(&device, &options, |row| {
        bar.set_message(row.to_owned());
        bar.set_position(begun);
        begun += 1;
    })?;
    bar.finish_and_clear();
    let text = bench::table(&report);
    if let Some(folder) = &args.save {
        let json = serde_json::to_string_pretty(&report).expect("plain data");
        sheetlight::files::make_folder(folder)?;
        write(&folder.join("bench.json"), &json)?;
        write(&folder.join("bench.txt"), &text)?;
    }
    console.result(&report, &text);
    Ok(())
}

/// Time of a shot and drops of a camera's pictures, here and elsewhere.
#[derive(serde::Serialize)]
struct Health {
    kept_up: Vec<KeptUp>,
    rows: Vec<WayTime>,
    recorded: Vec<WayTime>,
}

fn health(rate_hz: f64, seconds: f64, console: &Console) -> Result<()> {
    let kept_up = bench::keep_up(rate_hz, seconds, Where::default())?;
    let device = Device::open().ok();
    let found = Health { kept_up, rows: bench::way_times(device.as_ref())?, recorded: bench::recorded() };
    let share = |n: u64, k: &KeptUp| 100.0 * n as f64 / k.sent.max(1) as f64;
    let kept = |k: &KeptUp| {
        format!(
            "{:4}x{:<4} {} of {} pictures at {}/s measured, {:.1} % skipped, {:.1} % lost; p50 {:.2}, p99 {:.2} ms; {}",
            k.width,
            k.height,
            k.measured,
            k.sent,
            k.rate_hz,
            share(k.passed_over, k),
            share(k.lost, k),
            k.ms[0],
            k.ms[1],
            k.on
        )
    };
    let time = |w: &WayTime| format!("{:4}x{:<4} {:8.2} ms a shot, {}", w.width, w.height, w.ms_per_shot, w.on);
    let lines = found.kept_up.iter().map(kept).chain(found.rows.iter().map(time));
    let lines = lines.chain(found.recorded.iter().map(|w| time(w) + ", recorded"));
    console.result(&found, &lines.collect::<Vec<_>>().join("\n"));
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<()> {
    sheetlight::files::write(path, text.as_bytes())
}
