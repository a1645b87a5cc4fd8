//! In: sizes and scenes. Out: a table of speeds of this machine, or a file of it; or the peer's side of a
//! comparison on stdin and stdout. Frame and unit: ms, shots a second, pixels, GB/s.

use crate::bench::{self, BenchOptions, Scene};
use crate::cli::terminal::console::Console;
use crate::fault::Result;
use crate::gpu::Device;
use std::path::{Path, PathBuf};

/// Measure how fast the stripe chain is on this machine
///
/// Every row is one size and one scene: time a shot in steady state with several batches in flight, CPU time,
/// shares of what memory and upload could carry, latency of a single shot, and the GPU's time per stage; "resident" is the
/// rate with the pictures already where the stages read them, Mpx/s, "and full" that of the full chain. Below the table
/// stands what a shot costs by itself and what every further megapixel and, where all scenes are measured, every further per
/// cent of lit pixels adds.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight bench
  sheetlight bench --size 4096x3072 --scene one-stripe --seconds 10
  sheetlight bench --json --save benches/runs/2026-11-21-desk")]
pub struct Args {
    /// Picture size in pixels, may be repeated [default: 640x480, 1280x960, 4096x3072, 5120x5120]
    #[arg(long, value_parser = size)]
    size: Vec<(u32, u32)>,
    /// one-stripe, thick-stripe, upright-stripe, upright-thick, noise-heavy or reflection-heavy, may be repeated [default: all]
    #[arg(long, value_parser = scene)]
    scene: Vec<Scene>,
    /// Seconds a row runs
    #[arg(long, default_value_t = BenchOptions::default().seconds)]
    seconds: f64,
    /// Shots of a long run of the full chain, watched for growing memory (0: none)
    #[arg(long, default_value_t = 0)]
    soak: usize,
    /// Let a software adapter read arrays from buffers, as all other adapters do
    #[arg(long)]
    from_buffers: bool,
    /// Folder for bench.json and bench.txt
    #[arg(long)]
    save: Option<PathBuf>,
    /// Serve another program: settings and pictures on stdin, timings and masks on stdout (benches/peers)
    #[arg(long, hide = true)]
    peer_pipe: bool,
}

fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let both = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    both.ok_or_else(|| format!("'{text}' is not WIDTHxHEIGHT"))
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
        crate::files::make_folder(folder)?;
        write(&folder.join("bench.json"), &json)?;
        write(&folder.join("bench.txt"), &text)?;
    }
    console.result(&report, &text);
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<()> {
    crate::files::write(path, text.as_bytes())
}
