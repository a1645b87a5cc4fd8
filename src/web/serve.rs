//! In: a station, an address. Out: its screen, served until the program is told to end; what runs then is kept.
//! Frame and unit: none.

use super::api::router;
use super::camera::Camera;
use super::event::Hub;
use super::guard::{Door, Doorway, Sessions, door, tls, verify};
use super::message::Event;
use super::motion::{Desk, Links, SimulatedRobot};
use super::port::listen;
use super::robot::Robot;
use super::screen::Screen;
use super::work::{Jobs, Place, Worker};
use crate::capture::RawFormat;
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::station::settle_restore;
use crate::web::message::Mode;
use axum::middleware::from_fn_with_state;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What guards a screen that other machines may open.
#[derive(Clone, Debug)]
pub struct Secured {
    /// Argon2 hash of the password, as a PHC string.
    pub password: String,
    /// The certificate's chain, PEM.
    pub certificates: PathBuf,
    /// Its private key, PEM.
    pub key: PathBuf,
    /// Names by which browsers call this machine, beside the address that is listened on.
    pub names: Vec<String>,
}

/// How a screen is served.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// Folder below which recordings lie.
    pub recordings: PathBuf,
    /// Where pictures come from.
    pub mode: Mode,
    /// Address to listen on; others than this machine's own need `secured`.
    pub address: IpAddr,
    /// 0: any that is free.
    pub port: u16,
    /// The next free port is taken where this one is in use.
    pub next_free: bool,
    /// A camera's URI, and what frames on standard input are like.
    pub camera: Option<(String, Option<RawFormat>)>,
    /// A robot's URI.
    pub robot: Option<String>,
    /// It may be moved: --allow-motion.
    pub may_move: bool,
    /// Password and TLS.
    pub secured: Option<Secured>,
    /// Ends the server when it is set.
    pub stop: Arc<AtomicBool>,
}

/// How often is looked whether the server is to end.
const LOOK: Duration = Duration::from_millis(100);
/// The bar is told so often.
const BAR: Duration = Duration::from_secs(1);

/// Serves until `stop`; `simulated` is the cell that robot and camera are of, where it is one of ours. `ready` is
/// told the address to open, with the token of this start behind `#`, and where its port is another than was asked
/// for why.
///
/// # Errors
/// A station that is none or in use by another server, an address that cannot be listened on or is not guarded, bad
/// TLS files.
pub fn serve(
    options: &ServeOptions,
    simulated: Option<SimulatedRobot>,
    token: &str,
    ready: impl FnOnce(&str, Option<&str>) -> Result<()>,
) -> Result<()> {
    check(options)?;
    let place = Place { station: options.station.clone(), recordings: options.recordings.clone(), mode: options.mode };
    settle_restore(&place.station)?;
    crate::files::make_folder(&place.jobs())?;
    let _lock = Lock::take(&place.jobs(), "serve", "screen")?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .max_blocking_threads(8)
        .enable_all()
        .build()
        .map_err(|e| Fault::threads(&e))?;
    let hub = Arc::new(Hub::default());
    let camera = options.camera.as_ref();
    let camera = camera.map(|(uri, raw)| Camera::watch(uri, *raw, &options.station)).transpose()?.map(Arc::new);
    let robot = options.robot.as_deref().map(|uri| Robot::watch(uri, &options.station)).transpose()?.map(Arc::new);
    let links = Links {
        watched: robot.clone(),
        station: options.station.clone(),
        robot: options.robot.clone(),
        may_move: options.may_move,
        camera,
        simulated,
        stop: options.stop.clone(),
    };
    let desk = Arc::new(Desk::new(links, hub.clone()));
    let jobs = Jobs::open(place, hub, desk)?;
    let worker = Worker::start(jobs.clone())?;
    let served = runtime.block_on(run(options, token, jobs, ready));
    // The job that runs ends with its checkpoint before the program does.
    worker.close();
    runtime.shutdown_timeout(Duration::from_secs(2));
    served
}

fn check(options: &ServeOptions) -> Result<()> {
    if !options.station.join("station.toml").is_file() {
        return Err(Fault::usage(format!("{}: not a station (no station.toml)", options.station.display()))
            .cause("another folder was given, or the station was never made")
            .next("make one with sheetlight station new --station FOLDER, or look around first with --simulate"));
    }
    match &options.secured {
        Some(s) => verify("", &s.password).map(|_| ()),
        None if options.address.is_loopback() => Ok(()),
        None => Err(Fault::usage(format!("{} is not this machine's own address", options.address))
            .cause("anybody who reaches this screen can order scans and, with a linked robot, motions")
            .next("give --password-file, --tls-cert and --tls-key, or omit --listen")),
    }
}

fn lost(e: std::io::Error) -> Fault {
    Fault::device(format!("the server's port: {e}"))
        .cause("the network was taken away, or this process may open no more files")
        .next("start the server again; jobs that were cut off are offered to go on")
}

async fn run(
    options: &ServeOptions,
    token: &str,
    jobs: Arc<Jobs>,
    ready: impl FnOnce(&str, Option<&str>) -> Result<()>,
) -> Result<()> {
    let (listener, instead) = listen(options.address, options.port, options.next_free).await?;
    let address = listener.local_addr().map_err(lost)?;
    let acceptor = options.secured.as_ref().map(|s| tls(&s.certificates, &s.key)).transpose()?;
    let sessions = Arc::new(Sessions::new(token));
    let cookie = format!("sheetlight_{}", address.port());
    let scheme = if acceptor.is_some() { "https" } else { "http" };
    let guard =
        Arc::new(Door { hosts: hosts(options, address), scheme, sessions: sessions.clone(), cookie: cookie.clone() });
    let password = options.secured.as_ref().map(|s| s.password.clone());
    let screen = Arc::new(Screen::new(jobs, sessions, cookie, password));
    let app = router(screen.clone()).layer(from_fn_with_state(guard, door));
    let doorway = Doorway::new(listener, acceptor).map_err(lost)?;
    let first = screen.clone();
    // Adapters are asked for before the first page needs them.
    tokio::task::spawn_blocking(move || first.bar());
    tokio::spawn(bars(screen));
    ready(&format!("{scheme}://{address}/#token={token}"), instead.as_deref())?;
    let stop = options.stop.clone();
    let asked = async move {
        while !stop.load(Ordering::Relaxed) {
            tokio::time::sleep(LOOK).await;
        }
    };
    tokio::select! {
        served = axum::serve(doorway, app).into_future() => served.map_err(lost),
        () = asked => Ok(()),
    }
}

/// Names by which a browser may call this server.
fn hosts(options: &ServeOptions, address: SocketAddr) -> Vec<String> {
    let port = address.port();
    let mut hosts = vec![address.to_string()];
    if options.address.is_loopback() || options.address.is_unspecified() {
        hosts.extend([format!("localhost:{port}"), format!("127.0.0.1:{port}"), format!("[::1]:{port}")]);
    }
    let names = options.secured.iter().flat_map(|s| &s.names);
    hosts.extend(names.flat_map(|n| [format!("{}:{port}", n.to_lowercase()), n.to_lowercase()]));
    hosts
}

/// Tells the bar, while anybody looks on.
async fn bars(screen: Arc<Screen>) {
    let mut tick = tokio::time::interval(BAR);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    loop {
        tick.tick().await;
        if screen.hub.viewers() > 0 {
            let shared = screen.clone();
            let _ = tokio::task::spawn_blocking(move || shared.hub.tell(&Event::Bar(shared.bar()))).await;
        }
    }
}
