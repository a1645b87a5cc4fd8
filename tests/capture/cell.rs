//! In: a server that speaks the cell's protocol, cut off in the middle of a picture and started again. Out: its
//! pictures as they are, its clock, its features, its refusals; an account without a rest.
//! Frame and unit: pictures, ns.

use sheetlight::capture::wire::{Message, Sent, write};
use sheetlight::capture::{CameraUri, Fate, Fed, Feed, FeedOptions, RoundTrip};
use sheetlight::raster::Image;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

/// The server's clock counts from here.
static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);

fn picture(id: u64) -> Image {
    Image::from_u16(8, 4, 12, (0..32).map(|k| ((k * 100 + id) % 4096) as u16).collect())
}

/// Serves one connection; cut off in the middle of picture `cut`.
fn serve(stream: TcpStream, taken: Arc<AtomicU64>, cut: Option<u64>) {
    let out = Arc::new(Mutex::new(stream.try_clone().unwrap()));
    let send = |message: &Message, out: &Mutex<TcpStream>| out.lock().unwrap().write_all(&write(message)).is_ok();
    for line in BufReader::new(stream).lines().map_while(|l| l.ok()) {
        let answer = match line.split(' ').collect::<Vec<_>>()[..] {
            ["format"] => "ok 8 4 12".into(),
            ["time"] => format!("ok {}", BEGUN.elapsed().as_nanos()),
            ["features"] => "ok ExposureTime\t400\tus\t10\t1000".into(),
            ["set", "ExposureTime", "500"] => "ok".into(),
            ["start", _] => {
                let (out, taken) = (out.clone(), taken.clone());
                std::thread::spawn(move || {
                    for sent in 1.. {
                        let id = taken.fetch_add(1, Ordering::Relaxed);
                        let (device_ns, exposure_ns) = (id * 10_000_000, 1000);
                        let p = Sent { image: picture(id), id, device_ns, exposure_ns, count: Some(-7), sent };
                        let bytes = write(&Message::Picture(Box::new(p)));
                        let end = if cut == Some(id) { 50 } else { bytes.len() };
                        let mut out = out.lock().unwrap();
                        if out.write_all(&bytes[..end]).is_err() || end < bytes.len() {
                            let _ = out.shutdown(std::net::Shutdown::Both);
                            return;
                        }
                        drop(out);
                        std::thread::sleep(Duration::from_millis(10));
                    }
                });
                "ok".into()
            }
            _ => format!("error no such thing: {line}"),
        };
        if !send(&Message::Text(answer), &out) {
            return;
        }
    }
}

#[test]
fn a_cells_camera_is_read_cut_off_and_read_again() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let uri = format!("cell://{}", listener.local_addr().unwrap());
    let taken = Arc::new(AtomicU64::new(0));
    std::thread::spawn(move || {
        let mut cut = Some(30);
        for stream in listener.incoming().map_while(|s| s.ok()) {
            let (taken, cut) = (taken.clone(), cut.take());
            std::thread::spawn(move || serve(stream, taken, cut));
        }
    });
    let source = uri.parse::<CameraUri>().unwrap().open(None).unwrap();
    let options = FeedOptions { shots: Some(60), ..FeedOptions::default() };
    let feed = Feed::start(source, options).unwrap();
    let mut said = Vec::new();
    loop {
        said.extend(feed.news());
        match feed.next(Duration::from_secs(60)) {
            Fed::Picture(p, _) => {
                assert_eq!((&p.image, p.count, p.device_ns), (&picture(p.id), Some(-7), Some(p.id * 10_000_000)));
                feed.fate(Fate::Used);
            }
            Fed::Quiet => panic!("nothing comes: {said:?}"),
            Fed::Ended(fault) => break assert!(fault.is_none()),
        }
    }
    let a = feed.account();
    assert_eq!((a.used, a.outages, a.unexplained()), (60, 1, 0), "{a} {said:?}");
    assert!(a.missed > 0 && said[0].contains("gone"), "{a} {said:?}");
    let mut camera = uri.parse::<CameraUri>().unwrap().open(None).unwrap();
    let trip: RoundTrip = camera.clock().unwrap().unwrap();
    assert!(trip.there_ns > 100_000_000 && trip.after_ns > trip.before_ns);
    let features = camera.features().unwrap();
    assert_eq!((features[0].name.as_str(), features[0].unit.as_str()), ("ExposureTime", "us"));
    camera.set("ExposureTime", "500").unwrap();
    assert!(camera.set("Gain", "1").unwrap_err().what.contains("no such thing"));
}
