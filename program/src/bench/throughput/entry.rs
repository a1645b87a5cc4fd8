//! In: pictures on standard input. Out: their points on standard output, by this program's chain (docs/benchmark.md).
//! Frame and unit: px; camera frame, mm.

use super::wire::{FORMAT, Found, Header, Hello, Scenario, lost, picture, read_picture, write_points};
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Plane, Vec3};
use sheetlight::raster::Image;
use sheetlight::scan::{Engine, Extraction, Format, Measured, Optical, Place, Where};
use std::io::{BufRead, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Every depth is credible: the benchmark has no working volume.
const DEPTH_MM: [f64; 2] = [1.0, 1e5];
/// Pictures that are read ahead, and at most used to measure the stripe.
const AHEAD: usize = 4;
/// In `Offline`, a batch that is not full starts when no picture has come for this long.
const QUIET: Duration = Duration::from_millis(2);

fn broken(what: impl std::fmt::Display) -> Fault {
    Fault::input(format!("bench entry: {what}"))
        .cause("standard input is not a benchmark's driver")
        .next("run it through sheetlight bench run, as docs/benchmark.md shows")
}

/// Answers a driver until its input ends. With `nothing`, pictures are read and no points are returned, which measures
/// what the pipe takes.
///
/// # Errors
/// Input in another format; no GPU if one is requested; a pipe that fails.
pub fn serve(
    place: Where,
    nothing: bool,
    mut input: impl BufRead + Send + 'static,
    mut output: impl Write,
) -> Result<()> {
    let mut line = String::new();
    input.by_ref().take(65_536).read_line(&mut line).map_err(lost)?;
    let header: Header = serde_json::from_str(&line).map_err(broken)?;
    if header.sheetlight_bench != FORMAT {
        return Err(broken(format!("the driver speaks format {}, {FORMAT} is known", header.sheetlight_bench)));
    }
    let mut engine = engine(&header, place)?;
    let (name, settings) = if nothing {
        ("nothing".to_owned(), "reads the pictures and returns no points".to_owned())
    } else {
        ("Sheetlight".to_owned(), engine.ran_on())
    };
    let hello = Hello { name, version: env!("CARGO_PKG_VERSION").into(), settings };
    writeln!(output, "{}", serde_json::to_string(&hello).expect("plain data")).map_err(lost)?;
    output.flush().map_err(lost)?;
    let (send, pictures) = sync_channel::<Result<(u32, Image)>>(AHEAD);
    let of = header.clone();
    std::thread::Builder::new()
        .name("pictures".into())
        .spawn(move || {
            let bytes = of.picture_bytes();
            while let Some(next) = read_picture(&mut input, bytes).transpose() {
                if send.send(next.map(|(n, bytes)| (n, picture(&of, bytes)))).is_err() {
                    return;
                }
            }
        })
        .map_err(lost)?;
    if nothing {
        while let Ok(next) = pictures.recv() {
            write_points(&mut output, next?.0, &[])?;
        }
        return Ok(());
    }
    learn_then_run(&mut engine, header.scenario, &pictures, &mut output)
}

fn engine(header: &Header, place: Where) -> Result<Engine> {
    let (c, p) = (&header.camera, &header.plane);
    let camera = Intrinsics {
        fx: c.fx,
        fy: c.fy,
        cx: c.cx,
        cy: c.cy,
        skew: 0.0,
        distortion: Distortion::from_opencv(&c.distortion).ok_or_else(|| broken("the lens has not five terms"))?,
        width: header.width,
        height: header.height,
    };
    camera.check()?;
    let laser = Plane::new(Vec3::from(p.normal), p.offset_mm).ok_or_else(|| broken("the plane's normal is zero"))?;
    let format = Format { width: header.width, height: header.height, bits: header.bits };
    let optical = Optical { camera, laser, depth_mm: DEPTH_MM };
    let engine = Engine::new(format, &optical, &Extraction::default(), None, place.open()?);
    let singly = matches!(header.scenario, Scenario::Single | Scenario::Camera);
    Ok(if singly { engine.one_at_a_time() } else { engine })
}

/// Measures the stripe in the first pictures that show it, as a scan does, then answers every picture.
fn learn_then_run(
    engine: &mut Engine,
    scenario: Scenario,
    pictures: &Receiver<Result<(u32, Image)>>,
    output: &mut impl Write,
) -> Result<()> {
    let quiet = if matches!(scenario, Scenario::Single | Scenario::Camera) { Duration::ZERO } else { QUIET };
    let mut waiting = 0usize;
    while waiting == 0 {
        let first = some(pictures, quiet)?;
        if first.is_empty() {
            return Ok(());
        }
        let Some(seen) = engine.measure(&first.iter().map(|(_, image)| image).collect::<Vec<_>>()) else {
            first.iter().try_for_each(|(number, _)| write_points(output, *number, &[]))?;
            continue;
        };
        engine.set_stripe(&seen.stripe)?;
        engine.set_hot(seen.hot);
        for (number, image) in first {
            engine.submit(number, image, Place::camera())?;
            waiting += 1;
        }
    }
    loop {
        let next = if waiting == 0 {
            pictures.recv().map_err(|_| RecvTimeoutError::Disconnected)
        } else {
            pictures.recv_timeout(quiet)
        };
        let all = match next {
            Ok(next) => {
                let (number, image) = next?;
                engine.submit(number, image, Place::camera())?;
                waiting += 1;
                false
            }
            Err(RecvTimeoutError::Disconnected) if waiting == 0 => return Ok(()),
            Err(_) => true,
        };
        for measured in engine.collect(all)? {
            waiting -= 1;
            write_points(output, measured.shot, &kept(&measured))?;
        }
    }
}

/// The next pictures, and those that wait behind it: the driver may wait for the answer to its first picture before it
/// sends the second. None at the end of the input.
fn some(pictures: &Receiver<Result<(u32, Image)>>, quiet: Duration) -> Result<Vec<(u32, Image)>> {
    let mut some = Vec::new();
    while some.len() < AHEAD {
        let next = if some.is_empty() { pictures.recv().ok() } else { pictures.recv_timeout(quiet).ok() };
        let Some(next) = next else { break };
        some.push(next?);
    }
    Ok(some)
}

/// The points that no test rejected.
fn kept(measured: &Measured) -> Vec<Found> {
    let both = measured.peaks.iter().zip(&measured.points);
    let kept = both.filter(|(peak, point)| peak.kept() && point.sigma_mm.is_finite());
    kept.map(|(k, p)| Found { u: k.u, v: k.v, sigma_px: k.sigma_px, xyz: p.position.to_array() }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::drawing::draw;
    use super::super::scene::{SceneKind, Task};
    use super::super::score::Score;
    use super::super::wire::{picture_bytes, read_points};
    use super::*;
    use std::io::{BufReader, Cursor};

    /// What the entry answers to three pictures of a task, scored.
    fn answered(task: &Task, scenario: Scenario) -> (Vec<u32>, super::super::result::Accuracy) {
        let mut sent = format!("{}\n", serde_json::to_string(&task.header(scenario)).unwrap()).into_bytes();
        for n in 0..3u32 {
            sent.extend(n.to_le_bytes());
            sent.extend(picture_bytes(&draw(task, n)));
        }
        let mut came = Vec::new();
        serve(Where::Cpu, false, Cursor::new(sent), &mut came).unwrap();
        let mut read = BufReader::new(&came[..]);
        let mut hello = String::new();
        read.read_line(&mut hello).unwrap();
        assert_eq!(serde_json::from_str::<Hello>(&hello).unwrap().name, "Sheetlight");
        let (mut score, mut numbers) = (Score::default(), Vec::new());
        while let Some((n, points)) = read_points(&mut read).unwrap() {
            score.add(task, n, &points);
            numbers.push(n);
        }
        (numbers, score.accuracy())
    }

    #[test]
    fn every_picture_is_answered_in_order_with_points_on_the_line() {
        let scenes =
            [(SceneKind::Clean, 8), (SceneKind::Slanted, 12), (SceneKind::Reflections, 8), (SceneKind::Dim, 8)];
        for (scene, bits) in scenes {
            for scenario in [Scenario::Single, Scenario::Offline] {
                let task = Task { scene, width: 640, height: 480, bits };
                let (numbers, a) = answered(&task, scenario);
                assert_eq!(numbers, [0, 1, 2]);
                // Spots that touch the line pull its points. A slanted line leaves the picture at two borders, where
                // single points are off by a pixel.
                let [least, rms, wrong] = match scene {
                    SceneKind::Reflections => [0.9, 0.25, 0.12],
                    SceneKind::Slanted => [0.98, 0.15, 0.002],
                    // Ten times the noise.
                    SceneKind::Dim => [0.9, 0.3, 0.01],
                    _ => [0.98, 0.05, 0.001],
                };
                let middle = if scene == SceneKind::Dim { 0.15 } else { 0.03 };
                assert!(a.median_px.unwrap() < middle, "{} {a:?}", task.name());
                assert!(a.found.unwrap() > least && a.rms_px.unwrap() < rms, "{} {a:?}", task.name());
                assert!(a.false_share.unwrap() < wrong, "{} {a:?}", task.name());
            }
        }
        for (width, height, scenario) in [(320, 240, Scenario::Offline), (640, 480, Scenario::Single)] {
            let (numbers, a) = answered(&Task { scene: SceneKind::Dark, width, height, bits: 8 }, scenario);
            assert!(numbers == [0, 1, 2] && a.false_a_picture < 1.0, "{a:?}");
        }
    }

    #[test]
    fn input_that_is_no_driver_is_refused() {
        let mut out = Vec::new();
        let fault = |text: &str, out: &mut Vec<u8>| {
            serve(Where::Cpu, false, Cursor::new(text.as_bytes().to_vec()), out).unwrap_err()
        };
        assert!(!fault("hello\n", &mut out).next.is_empty());
        let other = serde_json::to_string(&Task::example(64, 64, 8).header(Scenario::Offline)).unwrap();
        let other = other.replace("\"sheetlight_bench\":1", "\"sheetlight_bench\":9") + "\n";
        assert!(fault(&other, &mut out).what.contains("format 9"), "{}", fault(&other, &mut out).what);
    }
}
