//! In: what the bar shows, the camera's account, the jobs. Out: the same as figures that Prometheus scrapes.
//! Frame and unit: seconds, bytes, mm, days as the names say.

use super::answer::{Answer, beside};
use crate::web::event::MQTT;
use crate::web::message::{Job, RobotState};
use crate::web::plc::MODBUS;
use crate::web::screen::Screen;
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use serde::Serialize;
use sheetlight::capture::metrics::{MEDIA, Metrics};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Jobs that are counted, the newest first.
const JOBS: usize = 10_000;

/// GET /metrics
pub async fn metrics(State(screen): State<Arc<Screen>>) -> Answer<impl IntoResponse> {
    let text = beside(screen, |s| Ok(text(s))).await?;
    Ok(([(header::CONTENT_TYPE, MEDIA)], text))
}

fn text(screen: &Screen) -> String {
    let bar = screen.bar();
    let mut m = Metrics::default();
    let build = [(vec![("version", env!("CARGO_PKG_VERSION")), ("station", bar.station.as_str())], 1)];
    m.family(("sheetlight_build_info", "gauge"), "Version of the program and name of its station.", build);
    if let Some(camera) = screen.camera() {
        // Not its address: that may hold a password.
        camera.account().count("live", &mut m);
        m.one(("sheetlight_camera_rate_hz", "gauge"), "Pictures a second that the camera sends.", camera.rate_hz());
    }
    let dropped = bar.frames.dropped.iter().map(|(why, n)| (vec![("reason", why.as_str())], *n));
    m.one(("sheetlight_shots_seen", "gauge"), "Pictures of the present scan or view.", Some(bar.frames.seen));
    m.one(("sheetlight_shots_measured", "gauge"), "Those with at least one point.", Some(bar.frames.measured));
    m.family(("sheetlight_shots_dropped", "gauge"), "Those that were skipped, by reason.", dropped);
    let delays = bar.delay_ms.map(|[middle, most]| [("0.5", middle), ("0.99", most)]).into_iter().flatten();
    let delays = delays.map(|(q, ms)| (vec![("quantile", q)], ms * 1e-3));
    m.family(("sheetlight_delay_seconds", "gauge"), "From a picture to its points.", delays);

    let states = counted(&screen.jobs.list(JOBS));
    let jobs = states
        .iter()
        .map(|((procedure, state), n)| (vec![("procedure", procedure.as_str()), ("state", state.as_str())], *n));
    m.family(("sheetlight_jobs", "gauge"), "Jobs on the disk by procedure and state.", jobs);
    m.one(("sheetlight_job_running", "gauge"), "1 while a job runs.", Some(u8::from(bar.running.is_some())));
    m.one(("sheetlight_alarms", "gauge"), "Alarms that the bar shows.", Some(bar.alarms.len()));

    let links = screen.hub.links();
    let of = |door: &str| links.iter().find(|link| link.door == door);
    let broker = of(MQTT).map(|link| u8::from(link.problem.is_none()));
    m.one(("sheetlight_mqtt_connected", "gauge"), "1 while the MQTT broker is connected.", broker);
    let plcs = of(MODBUS).map(|link| link.peers.len());
    m.one(("sheetlight_modbus_peers", "gauge"), "Connections of Modbus that are open.", plcs);
    let frames = [("answered", of(MODBUS).map(|l| l.sent)), ("refused", of(MODBUS).map(|l| l.lost))];
    let frames = frames.into_iter().filter_map(|(result, n)| n.map(|n| (vec![("result", result)], n)));
    m.family(("sheetlight_modbus_frames_total", "counter"), "Frames over Modbus by result.", frames);
    let linked = u8::from(bar.robot != RobotState::NoLink);
    m.one(("sheetlight_robot_linked", "gauge"), "1 while the robot answers.", Some(linked));
    let armed = u8::from(matches!(bar.robot, RobotState::Armed | RobotState::Moving));
    m.one(("sheetlight_robot_armed", "gauge"), "1 while motions may be confirmed.", Some(armed));
    m.one(("sheetlight_laser_on", "gauge"), "1 while line or pointer is on.", bar.laser.map(u8::from));

    let calibration = bar.calibration.as_ref();
    let age = calibration.map(|c| c.days);
    m.one(("sheetlight_calibration_age_days", "gauge"), "Age of the oldest calibration.", age);
    let expected = calibration.and_then(|c| c.expected_mm);
    let help = "Error that all calibrations make expect at the working distance, 1 sigma.";
    m.one(("sheetlight_calibration_expected_error_mm", "gauge"), help, expected);
    let verdict = calibration.map(|c| (vec![("verdict", c.verdict.as_str()), ("of", c.worst.as_str())], 1));
    m.family(("sheetlight_calibration_worst_verdict", "gauge"), "Worst verdict and which calibration has it.", verdict);

    let free = bar.disk_left_gb.map(|gb| (gb * 1e9) as u64);
    m.one(("sheetlight_disk_free_bytes", "gauge"), "On the disk that holds the jobs.", free);
    let memory = bar.memory_mb.map(|[now, _]| (now * 1e6) as u64);
    m.one(("sheetlight_memory_bytes", "gauge"), "Memory of the program.", memory);
    m.one(("sheetlight_viewers", "gauge"), "Browsers that are connected.", Some(bar.viewers));
    m.text()
}

/// Number of jobs by procedure and state.
fn counted(jobs: &[Job]) -> BTreeMap<(String, String), usize> {
    let mut counts = BTreeMap::new();
    for job in jobs {
        let order = serde_json::to_value(&job.order).unwrap_or_default();
        let procedure = order["procedure"].as_str().unwrap_or("unknown").to_owned();
        *counts.entry((procedure, word(&job.state))).or_default() += 1;
    }
    counts
}

/// A state as messages write it.
fn word(state: &(impl Serialize + std::fmt::Debug)) -> String {
    let value = serde_json::to_value(state).ok();
    value.and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_else(|| format!("{state:?}"))
}
