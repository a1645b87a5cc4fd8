//! In: on stdin one JSON line of settings, raw 8-bit pictures, then commands. Out: on stdout one JSON line an
//! answer, and raw masks: another program times its chain against ours on the same pictures, in turns.
//! Frame and unit: pixels; seconds.

use super::machine;
use crate::fault::{Fault, Result};
use crate::gpu::Device;
use crate::raster::Image;
use crate::stages::chain::{Chain, ChainConfig};
use crate::stages::{ThresholdParams, Window};
use std::io::{BufRead, Write};
use std::time::Instant;

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Setup {
    width: u32,
    height: u32,
    count: usize,
    shots_per_batch: u32,
    size: u32,
    offset: i32,
    #[serde(default)]
    minimum: u16,
}

#[derive(serde::Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Command {
    /// Run all pictures so many times over, several batches in flight.
    Run(usize),
    /// The thresholded and the thinned mask of one picture, 0 and 255.
    Masks(usize),
    Quit,
}

fn broken(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("peer: {what}")).cause("the other program and this one speak different versions")
}

/// Serves one peer until it says quit or closes the pipe.
pub fn serve(device: &Device, mut input: impl BufRead, mut output: impl Write) -> Result<()> {
    let lost = |e: std::io::Error| broken(e);
    let mut line = String::new();
    input.read_line(&mut line).map_err(lost)?;
    let setup: Setup = serde_json::from_str(&line).map_err(broken)?;
    let mut images = Vec::new();
    for _ in 0..setup.count {
        let mut pixels = vec![0; setup.width as usize * setup.height as usize];
        input.read_exact(&mut pixels).map_err(lost)?;
        images.push(Image::from_u8(setup.width, setup.height, pixels));
    }
    let config = ChainConfig {
        shots: setup.shots_per_batch,
        threshold: ThresholdParams {
            window: Window::Mean,
            size: setup.size,
            offset: setup.offset,
            minimum: setup.minimum,
        },
        ..ChainConfig::new(setup.width, setup.height, 8)
    };
    let mut chain = Chain::new(device, &config)?;
    run(&mut chain, &images, 1)?;
    let mut single = Chain::new(device, &ChainConfig { shots: 1, slots: 1, ..config })?;
    writeln!(output, "{}", serde_json::json!({"ready": device.info.name})).map_err(lost)?;
    output.flush().map_err(lost)?;
    loop {
        line.clear();
        if input.read_line(&mut line).map_err(lost)? == 0 {
            return Ok(());
        }
        match serde_json::from_str(&line).map_err(broken)? {
            Command::Quit => return Ok(()),
            Command::Run(times) => {
                let (cpu, start) = (machine::cpu_seconds(), Instant::now());
                let points = run(&mut chain, &images, times)?;
                let wall = start.elapsed().as_secs_f64();
                let cpu = cpu.and_then(|c| Some(machine::cpu_seconds()? - c));
                let answer =
                    serde_json::json!({"wall_s": wall, "cpu_s": cpu, "shots": times * images.len(), "points": points});
                writeln!(output, "{answer}").map_err(lost)?;
            }
            Command::Masks(i) => {
                single.submit(0, &[&images[i]])?;
                single.collect(true)?;
                output.write_all(&single.lit(0)?.to_u8()).map_err(lost)?;
                output.write_all(&single.mask(0)?.to_u8()).map_err(lost)?;
            }
        }
        output.flush().map_err(lost)?;
    }
}

/// Runs all pictures; the number of skeleton pixels.
fn run(chain: &mut Chain, images: &[Image], times: usize) -> Result<usize> {
    let order: Vec<&Image> = (0..times).flat_map(|_| images).collect();
    let mut points = 0;
    for batch in order.chunks(chain.frame.shots as usize) {
        if !chain.has_room() {
            points += chain.collect(true)?.map_or(0, |b| b.points.len());
        }
        chain.submit(0, batch)?;
    }
    while let Some(batch) = chain.collect(true)? {
        points += batch.points.len();
    }
    Ok(points)
}
