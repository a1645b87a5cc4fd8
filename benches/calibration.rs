//! In: OpenCV's sample photographs (SHEETLIGHT_REFERENCE) and the corners committed for the tests.
//! Out: time of board detection per picture and of the camera solve on 26 pictures' corners.
//! Frame and unit: milliseconds of CPU time of all threads, so that other programs do not count;
//! benches/peers/calibration.py measures OpenCV on the same input.

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, criterion_group, criterion_main};
use sheetlight::calibrate::boards::{BoardPoint, BoardView, FindOptions, find};
use sheetlight::calibrate::camera::intrinsics::{Boards, Observation, SolveOptions, solve};
use sheetlight::calibrate::camera::lens::Lens;
use sheetlight::geometry::Vec2;
use sheetlight::raster::{Channel, Image, load};
use sheetlight::recording::BoardSpec;
use sheetlight::solve::Loss;
use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The program's own.
#[global_allocator]
static MEMORY: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// CPU time of this process's threads (Linux); the clock on the wall elsewhere.
struct CpuTime;

fn cpu_time() -> Option<Duration> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let mut sum = 0;
    for thread in threads.flatten() {
        // The first number: nanoseconds on a processor. A thread may have ended since it was listed.
        let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) else { continue };
        sum += text.split_whitespace().next()?.parse::<u64>().ok()?;
    }
    Some(Duration::from_nanos(sum))
}

impl Measurement for CpuTime {
    type Intermediate = (Instant, Option<Duration>);
    type Value = Duration;
    fn start(&self) -> Self::Intermediate {
        (Instant::now(), cpu_time())
    }
    fn end(&self, (wall, cpu): Self::Intermediate) -> Duration {
        match (cpu, cpu_time()) {
            (Some(before), Some(now)) => now.saturating_sub(before),
            _ => wall.elapsed(),
        }
    }
    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }
    fn zero(&self) -> Duration {
        Duration::ZERO
    }
    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }
    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

fn board() -> BoardSpec {
    BoardSpec::Chessboard { inner_corners: [9, 6], square_mm: 1.0, border_mm: 0.0, first_square: "black".into() }
}

/// The 13 left or right pictures' corners.
fn corners(side: &str) -> Vec<Observation> {
    let all: serde_json::Value = serde_json::from_str(include_str!("../tests/data/opencv_corners.json")).unwrap();
    let corners: Vec<Vec<[f64; 2]>> = serde_json::from_value(all["sets"][side]["corners"].clone()).unwrap();
    let features = Arc::new(board().features());
    let observation = |(i, c): (usize, Vec<[f64; 2]>)| {
        let point = |(feature_id, p): (usize, &[f64; 2])| BoardPoint {
            feature_id,
            pixel: Vec2::new(p[0], p[1]),
            sigma_px: 0.1,
        };
        let points = c.iter().enumerate().map(point).collect();
        Observation {
            name: i.to_string(),
            features: features.clone(),
            view: BoardView { points, ..BoardView::default() },
        }
    };
    corners.into_iter().enumerate().map(observation).collect()
}

fn photographs() -> Vec<Image> {
    let Some(folder) = std::env::var_os("SHEETLIGHT_REFERENCE").map(PathBuf::from) else {
        eprintln!("SKIPPED: detection needs SHEETLIGHT_REFERENCE");
        return Vec::new();
    };
    let folder = folder.join("camera/opencv_chessboard");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .map(|entries| {
            entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "jpg")).collect()
        })
        .unwrap_or_default();
    paths.sort();
    paths.iter().map(|p| load(p, Channel::Luma, 8).unwrap()).collect()
}

fn benches(c: &mut Criterion<CpuTime>) {
    let (left, right) = (corners("left"), corners("right"));
    let both: Vec<Observation> = left.iter().chain(&right).cloned().collect();
    // As cv2.calibrateCamera does it: five lens parameters, plain least squares.
    let plain =
        SolveOptions { lens: Lens::Five, skew: false, loss: Loss::Squares, weigh: false, boards: Boards::Drawn };
    let mut group = c.benchmark_group("camera solve");
    group.bench_function("13 + 13 pictures, two cameras", |b| {
        b.iter(|| {
            (solve(black_box(&left), 640, 480, &plain).unwrap(), solve(black_box(&right), 640, 480, &plain).unwrap())
        })
    });
    group.bench_function("26 pictures, one camera", |b| b.iter(|| solve(black_box(&both), 640, 480, &plain).unwrap()));
    group.finish();
    let pictures = photographs();
    if !pictures.is_empty() {
        let board = board();
        let mut group = c.benchmark_group("board detection");
        group.sample_size(10);
        group.bench_function(format!("{} photographs, one after another", pictures.len()), |b| {
            b.iter(|| pictures.iter().filter(|i| find(i, &board, &FindOptions::default()).is_ok()).count())
        });
        group.finish();
    }
}

criterion_group!(name = calibration; config = Criterion::default().with_measurement(CpuTime); targets = benches);
criterion_main!(calibration);
