//! Answers the viewers of the cell's cameras and sends their pictures (`capture::wire` has the protocol). Times are
//! in ns of the cell's clock.

use super::Faults;
use crate::cell::camera::EXPOSURES_US;
use crate::cell::cell::Cell;
use sheetlight::capture::wire::{Message, Sent, write};
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

const LOOK: Duration = Duration::from_millis(5);
/// Frame rates that can be requested, Hz.
const RATES_HZ: [f64; 2] = [0.01, 2000.0];

/// One client: its request, and the numbers of its pictures.
struct Viewer {
    cell: Cell,
    in_gripper: bool,
    stream: Mutex<TcpStream>,
    /// Frame rate, Hz; `None` while acquisition is stopped.
    rate: Mutex<Option<f64>>,
    taken: Mutex<[u64; 2]>,
}

pub(super) fn serve(
    listener: &TcpListener,
    cell: &Cell,
    in_gripper: bool,
    faults: &Arc<Faults>,
    over: &Arc<AtomicBool>,
) {
    if listener.set_nonblocking(true).is_err() {
        return;
    }
    while !over.load(Ordering::Relaxed) {
        let Ok((stream, _)) = listener.accept() else {
            std::thread::sleep(LOOK);
            continue;
        };
        if Faults::on(&faults.camera_gone) || stream.set_nonblocking(false).is_err() {
            continue;
        }
        let Ok(lines) = stream.try_clone() else { continue };
        let _ = stream.set_nodelay(true);
        let _ = stream.set_write_timeout(Some(Duration::from_secs(5)));
        let viewer = Arc::new(Viewer {
            cell: cell.clone(),
            in_gripper,
            stream: Mutex::new(stream),
            rate: Mutex::new(None),
            taken: Mutex::new([0; 2]),
        });
        let (v, o, f) = (viewer.clone(), over.clone(), faults.clone());
        let _ = std::thread::Builder::new().name("camera lines".into()).spawn(move || v.listen(lines, &o, &f));
        let (o, f) = (over.clone(), faults.clone());
        let _ = std::thread::Builder::new().name("camera pictures".into()).spawn(move || viewer.run(&o, &f));
    }
}

impl Viewer {
    fn send(&self, message: &Message) -> std::io::Result<()> {
        self.stream.lock().unwrap_or_else(PoisonError::into_inner).write_all(&write(message))
    }

    /// Takes a single picture; the cell's time is held while it is rendered.
    fn snap(&self) -> std::io::Result<()> {
        let held = self.cell.clock().hold();
        let message = self.picture(self.cell.clock().now());
        drop(held);
        self.send(&message)
    }

    fn exposure_us(&self) -> f64 {
        self.cell.exposure(self.in_gripper).us()
    }

    /// The picture of a past moment.
    fn picture(&self, t: f64) -> Message {
        let exposure_s = 1e-6 * self.exposure_us();
        let image = if self.in_gripper { self.cell.gripper_picture(t) } else { self.cell.picture(t) };
        let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let [id, sent] = *taken;
        *taken = [id + 1, sent + 1];
        let begun = t - 0.5 * exposure_s + 1e-3 * self.cell.options().camera_delay_ms;
        let (device_ns, exposure_ns) = ((begun.max(0.0) * 1e9) as u64, (exposure_s * 1e9).round() as u64);
        let sent = Sent { image, id, device_ns, exposure_ns, count: None, sent: sent + 1 };
        Message::Picture(Box::new(sent))
    }

    fn listen(&self, lines: TcpStream, over: &AtomicBool, faults: &Faults) {
        for line in BufReader::new(lines).lines() {
            let Ok(line) = line else { break };
            if over.load(Ordering::Relaxed) || Faults::on(&faults.camera_gone) {
                break;
            }
            let said = self.answer(line.trim());
            let snapped = line.trim() == "snap";
            if self.send(&Message::Text(said)).is_err() || (snapped && self.snap().is_err()) {
                break;
            }
        }
        let _ = self.stream.lock().unwrap_or_else(PoisonError::into_inner).shutdown(std::net::Shutdown::Both);
    }

    fn answer(&self, line: &str) -> String {
        let station = self.cell.station();
        let mut rate = self.rate.lock().unwrap_or_else(PoisonError::into_inner);
        match line.split_once(' ').unwrap_or((line, "")) {
            ("start", fps) => match fps.trim().parse::<f64>() {
                Ok(0.0) => {
                    *rate = Some(self.cell.options().fps);
                    "ok".into()
                }
                Ok(fps) if (RATES_HZ[0]..=RATES_HZ[1]).contains(&fps) => {
                    *rate = Some(fps);
                    "ok".into()
                }
                _ => format!("error '{fps}' is not a rate; allowed: 0.01 to 2000 pictures per second"),
            },
            ("stop", _) => {
                *rate = None;
                "ok".into()
            }
            ("snap", _) => "ok".into(),
            ("time", _) => format!("ok {}", (self.cell.clock().now() * 1e9) as u64),
            ("format", _) => {
                let camera = if self.in_gripper {
                    self.cell.gripper_format()
                } else {
                    [station.camera.width, station.camera.height]
                };
                format!("ok {} {} {}", camera[0], camera[1], station.sensor.bits)
            }
            ("features", _) => {
                let ([short, long], [slow, fast]) = (EXPOSURES_US, RATES_HZ);
                let (us, fps) = (self.exposure_us(), rate.unwrap_or(self.cell.options().fps));
                format!("ok\nExposureTime\t{us}\tus\t{short}\t{long}\nAcquisitionFrameRate\t{fps}\tHz\t{slow}\t{fast}")
            }
            ("set", words) => match words.split_once(' ').map(|(k, v)| (k, v.trim().parse::<f64>())) {
                Some(("AcquisitionFrameRate", Ok(fps))) if (RATES_HZ[0]..=RATES_HZ[1]).contains(&fps) => {
                    *rate = rate.map(|_| fps);
                    "ok".into()
                }
                Some(("ExposureTime", Ok(us))) if self.cell.exposure(self.in_gripper).set(us) => "ok".into(),
                _ => {
                    let ([short, long], [slow, fast]) = (EXPOSURES_US, RATES_HZ);
                    format!(
                        "error '{words}' cannot be set; ExposureTime {short} to {long} us and \
                         AcquisitionFrameRate {slow} to {fast} Hz can"
                    )
                }
            },
            _ => "error unknown; start FPS, stop, snap, time, format, features, set NAME VALUE are known".into(),
        }
    }

    /// Takes pictures at the requested rate, at regular moments of the cell's time, which is not held. Pictures
    /// whose moment passes while an earlier one is rendered count as taken but are not sent: their numbers are
    /// missing.
    fn run(&self, over: &AtomicBool, faults: &Faults) {
        let mut next = None::<f64>;
        while !over.load(Ordering::Relaxed) && !Faults::on(&faults.camera_gone) {
            let rate = *self.rate.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(asked) = rate else {
                next = None;
                std::thread::sleep(LOOK);
                continue;
            };
            // An exposure ends before the next one begins.
            let fps = asked.min(1e6 / self.exposure_us());
            let at = next.unwrap_or_else(|| self.cell.clock().now());
            if !self.cell.clock().wait(at, LOOK) {
                next = Some(at);
                continue;
            }
            let message = self.picture(at);
            if self.send(&message).is_err() {
                break;
            }
            let passed = ((self.cell.clock().now() - at) * fps).floor().max(1.0);
            self.taken.lock().unwrap_or_else(PoisonError::into_inner)[0] += passed as u64 - 1;
            next = Some(at + passed / fps);
        }
        let _ = self.stream.lock().unwrap_or_else(PoisonError::into_inner).shutdown(std::net::Shutdown::Both);
    }
}
