//! In: pictures on standard input. Out: points by vision-metrology's stripe extraction on standard output, in the
//! format of docs/benchmark.md. Frame and unit: px; camera frame, mm.

use serde_json::Value;
use std::error::Error;
use std::io::{BufRead, BufReader, Read, Write};
use vision_metrology::laser::{ColAccess, LaserExtractConfig, LaserExtractTuning, LaserExtractor, ScanAxis};
use vision_metrology::{Edge1DConfig, Image, Pixel};

const HELP: &str = "vision-metrology-entry [--sigma PX] [--gradient SHARE] [--widths PX PX] [--threads N]
--sigma     Gaussian before the edges, px [1.2]
--gradient  least gradient of an edge, share of full scale [0]
--widths    least and largest distance of the two edges, px [2 10]
--threads   number of threads, which share the columns [all]
Defaults are the crate's own.";

struct Options {
    sigma: f32,
    gradient: f32,
    widths: [f32; 2],
    threads: usize,
}

fn options() -> Result<Options, Box<dyn Error>> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let mut o = Options { sigma: 1.2, gradient: 0.0, widths: [2.0, 10.0], threads };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut next = || words.next().ok_or(HELP);
        match word.as_str() {
            "--sigma" => o.sigma = next()?.parse()?,
            "--gradient" => o.gradient = next()?.parse()?,
            "--widths" => o.widths = [next()?.parse()?, next()?.parse()?],
            "--threads" => o.threads = next()?.parse::<usize>()?.max(1),
            _ => return Err(HELP.into()),
        }
    }
    Ok(o)
}

/// Camera and laser plane of the header.
struct Rig {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    lens: [f64; 5],
    normal: [f64; 3],
    offset: f64,
}

impl Rig {
    fn of(header: &Value) -> Option<Rig> {
        let (c, p) = (&header["camera"], &header["plane"]);
        let list = |v: &Value, i: usize| v[i].as_f64();
        let lens: Option<Vec<f64>> = (0..5).map(|i| list(&c["distortion"], i)).collect();
        let normal: Option<Vec<f64>> = (0..3).map(|i| list(&p["normal"], i)).collect();
        Some(Rig {
            fx: c["fx"].as_f64()?,
            fy: c["fy"].as_f64()?,
            cx: c["cx"].as_f64()?,
            cy: c["cy"].as_f64()?,
            lens: lens?.try_into().ok()?,
            normal: normal?.try_into().ok()?,
            offset: p["offset_mm"].as_f64()?,
        })
    }

    /// Where the ray of a pixel meets the plane.
    fn point(&self, u: f64, v: f64) -> [f32; 3] {
        let (x0, y0) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let [k1, k2, p1, p2, k3] = self.lens;
        let (mut x, mut y) = (x0, y0);
        // Brown-Conrady is inverted by iteration; the error shrinks about fivefold a step.
        for _ in 0..12 {
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
            (x, y) = ((x0 - dx) / radial, (y0 - dy) / radial);
        }
        let [a, b, c] = self.normal;
        let z = self.offset / (a * x + b * y + c);
        [x * z, y * z, z].map(|w| w as f32)
    }
}

/// Centres of one picture: column, row.
fn centres<P: Pixel + Clone + Send + Sync>(
    image: &Image<P>,
    extractors: &mut [LaserExtractor],
    config: &LaserExtractConfig,
) -> Vec<(f32, f32)> {
    let view = image.as_view();
    let width = view.width();
    let share = width.div_ceil(extractors.len());
    std::thread::scope(|scope| {
        let parts: Vec<_> = extractors
            .iter_mut()
            .enumerate()
            .map(|(i, extractor)| {
                let columns = (i * share).min(width)..((i + 1) * share).min(width);
                let view = &view;
                scope.spawn(move || extractor.extract_line(view, columns, config, None))
            })
            .collect();
        let lines = parts.into_iter().filter_map(|p| p.join().ok()?.ok());
        lines.flat_map(|line| line.points.into_iter().map(|p| (p.x, p.y))).collect()
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let o = options()?;
    let mut input = BufReader::with_capacity(1 << 20, std::io::stdin().lock());
    let mut output = std::io::stdout().lock();
    let mut line = String::new();
    input.read_line(&mut line)?;
    let header: Value = serde_json::from_str(&line)?;
    let whole = |key: &str| header[key].as_u64().ok_or(format!("the header has no {key}"));
    let (width, height, bits) = (whole("width")? as usize, whole("height")? as usize, whole("bits")?);
    let rig = Rig::of(&header).ok_or("the header has no camera or no plane")?;
    let gradient = o.gradient * ((1u32 << bits) - 1) as f32;
    let config = LaserExtractConfig {
        axis: ScanAxis::Cols { access: ColAccess::Gather },
        min_width: o.widths[0],
        max_width: o.widths[1],
        tuning: LaserExtractTuning {
            edge_cfg: Edge1DConfig {
                sigma: o.sigma,
                pos_thresh: gradient,
                neg_thresh: gradient,
                ..LaserExtractTuning::default().edge_cfg
            },
            ..LaserExtractTuning::default()
        },
        ..LaserExtractConfig::default()
    };
    let mut extractors: Vec<_> = (0..o.threads).map(|_| LaserExtractor::new(o.sigma)).collect();
    let settings = format!(
        "columns, sigma {} px, gradient {}, widths {:?} px, {} threads",
        o.sigma, o.gradient, o.widths, o.threads
    );
    let hello = serde_json::json!({"name": "vision-metrology", "version": "db8a38c", "settings": settings});
    writeln!(output, "{hello}")?;
    output.flush()?;
    let mut pixels = vec![0; width * height * if bits == 8 { 1 } else { 2 }];
    let mut number = [0; 4];
    while input.read_exact(&mut number).is_ok() {
        input.read_exact(&mut pixels)?;
        let found = if bits == 8 {
            centres(&Image::from_vec(width, height, pixels.clone())?, &mut extractors, &config)
        } else {
            let words = pixels.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
            centres(&Image::<u16>::from_vec(width, height, words)?, &mut extractors, &config)
        };
        let mut reply = Vec::with_capacity(8 + 24 * found.len());
        reply.extend(number);
        reply.extend((found.len() as u32).to_le_bytes());
        for (u, v) in found {
            let [x, y, z] = rig.point(u.into(), v.into());
            reply.extend([u, v, f32::NAN, x, y, z].iter().flat_map(|n| n.to_le_bytes()));
        }
        output.write_all(&reply)?;
        output.flush()?;
    }
    Ok(())
}
