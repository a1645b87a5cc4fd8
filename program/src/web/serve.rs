//! In: a station, an address. Out: its screen, served until the program is asked to end; the state of a running job
//! is stored.
//! Frame and unit: none.

use super::api::router;
use super::camera::Camera;
use super::event::{Broker, Hub, Source, publish, publish_node};
use super::guard::{Door, Doorway, Hosts, Peer, Sessions, Tries, door, tls, verify};
use super::message::Event;
use super::motion::{Desk, Links, SimulatedRobot};
use super::plc;
use super::port::listen;
use super::robot::Robot;
use super::screen::{JOBS, Screen};
use super::work::{Jobs, Place, Worker};
use crate::web::message::Mode;
use axum::middleware::from_fn_with_state;
use sheetlight::capture::RawFormat;
use sheetlight::fault::{Fault, Result};
use sheetlight::files::Lock;
use sheetlight::station::settle_restore;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};

/// Protection of a screen that other machines may open.
#[derive(Clone, Debug)]
pub struct Secured {
    /// Argon2 hash of the password, as a PHC string.
    pub password: String,
    /// The certificate's chain, PEM.
    pub certificates: PathBuf,
    /// Its private key, PEM.
    pub key: PathBuf,
    /// Names by which browsers call this machine, in addition to the address that they connect to.
    pub names: Vec<String>,
}

/// Options for serving a screen.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// Folder that contains the recordings.
    pub recordings: PathBuf,
    /// Source of the pictures.
    pub mode: Mode,
    /// Address to listen on; addresses that other machines can reach need `secured`.
    pub address: IpAddr,
    /// 0: any free port.
    pub port: u16,
    /// Use the next free port if this one is in use.
    pub next_free: bool,
    /// A camera's URI, and the format of frames on standard input.
    pub camera: Option<(String, Option<RawFormat>)>,
    /// A robot's URI.
    pub robot: Option<String>,
    /// The robot may be moved: --allow-motion.
    pub may_move: bool,
    /// Password and TLS.
    pub secured: Option<Secured>,
    /// Token by which a program may read the figures, and nothing else.
    pub metrics: Option<String>,
    /// Where state and results are published.
    pub mqtt: Option<Broker>,
    /// Address at which PLCs may ask for jobs over Modbus TCP, which has no login; port 0: any free one.
    pub modbus: Option<SocketAddr>,
    /// Ends the server when it is set.
    pub stop: Arc<AtomicBool>,
}

/// What a person must know of a server that has started.
pub struct Opened<'a> {
    /// The address to open, with the token of this start after `#`.
    pub url: &'a str,
    /// Why the port is not the requested one.
    pub instead: Option<&'a str>,
    /// Address of the registers for a PLC.
    pub modbus: Option<SocketAddr>,
}

/// Interval at which the server checks whether to end.
const LOOK: Duration = Duration::from_millis(100);
/// Interval at which the bar is sent.
const BAR: Duration = Duration::from_secs(1);

/// Serves until `stop`. `simulated` is the cell to which robot and camera belong, if they are simulated. `ready`
/// is called when everything that was asked for is open.
///
/// # Errors
/// An invalid station or one that another server uses, an address that is unavailable or unprotected, invalid TLS
/// files.
pub fn serve(
    options: &ServeOptions,
    simulated: Option<SimulatedRobot>,
    token: &str,
    ready: impl FnOnce(&Opened) -> Result<()>,
) -> Result<()> {
    check(options)?;
    let place = Place { station: options.station.clone(), recordings: options.recordings.clone(), mode: options.mode };
    settle_restore(&place.station)?;
    sheetlight::files::make_folder(&place.jobs())?;
    let _lock = Lock::take(&place.jobs(), "serve", "screen")?;
    let runtime = runtime()?;
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
    // The running job ends with its checkpoint before the program does.
    worker.close();
    runtime.shutdown_timeout(Duration::from_secs(2));
    served
}

/// Number of threads for slow work: pictures, clouds, the disk.
const WORKERS: usize = 8;

/// Two threads for requests, and the worker threads.
fn runtime() -> Result<Runtime> {
    let threads = Builder::new_multi_thread().worker_threads(2).max_blocking_threads(WORKERS).enable_all().build();
    threads.map_err(|e| Fault::threads(&e))
}

fn check(options: &ServeOptions) -> Result<()> {
    if !options.station.join("station.toml").is_file() {
        return Err(Fault::usage(format!("{}: not a station (no station.toml)", options.station.display()))
            .cause("another folder was given, or the station was never made")
            .next("make one with sheetlight station new --station FOLDER, or look around first with --simulate"));
    }
    hosts(options)?;
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
    ready: impl FnOnce(&Opened) -> Result<()>,
) -> Result<()> {
    let (listener, instead) = listen(options.address, options.port, options.next_free).await?;
    let address = listener.local_addr().map_err(lost)?;
    let acceptor = options.secured.as_ref().map(|s| tls(&s.certificates, &s.key)).transpose()?;
    let sessions = Arc::new(Sessions::new(token));
    let cookie = format!("sheetlight_{}", address.port());
    let hosts = hosts(options)?;
    let url = hosts.url(address);
    let guard =
        Arc::new(Door { hosts, sessions: sessions.clone(), metrics: options.metrics.clone(), cookie: cookie.clone() });
    let password = options.secured.as_ref().map(|s| Tries::against(s.password.clone())).transpose()?;
    let screen = Arc::new(Screen::new(jobs, sessions, cookie, password));
    let app = router(screen.clone()).layer(from_fn_with_state(guard, door));
    let app = app.into_make_service_with_connect_info::<Peer>();
    let doorway = Doorway::new(listener, acceptor).map_err(lost)?;
    let first = screen.clone();
    // Adapters are queried before the first page needs them.
    tokio::task::spawn_blocking(move || first.bar());
    if let Some(broker) = options.mqtt.clone() {
        told(broker, &screen);
    }
    // Before anybody is told of it: an address that is not available ends the start. It closes with this function.
    let plcs = options.modbus.map(|at| plc::Door::open(at, screen.clone())).transpose()?;
    tokio::spawn(bars(screen));
    let modbus = plcs.as_ref().map(|door| door.address);
    ready(&Opened { url: &format!("{url}/#token={token}"), instead: instead.as_deref(), modbus })?;
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

/// Publishes what happens at a broker.
fn told(broker: Broker, screen: &Screen) {
    let hub = screen.hub.clone();
    match broker.names().cloned() {
        None => drop(tokio::spawn(publish(broker, hub))),
        Some(names) => {
            let camera = screen.camera().cloned();
            let rate_hz = move || camera.as_ref().and_then(|camera| camera.rate_hz());
            let jobs = screen.jobs.clone();
            let source = Source { hub, jobs: move || jobs.list(JOBS), rate_hz };
            drop(tokio::spawn(publish_node(broker, names, source)));
        }
    }
}

/// Names by which a browser may call this server.
fn hosts(options: &ServeOptions) -> Result<Hosts> {
    let secured = options.secured.as_ref();
    Hosts::new(secured.is_some(), secured.map_or(&[][..], |s| &s.names))
}

/// Sends the bar while anybody receives it.
async fn bars(screen: Arc<Screen>) {
    let mut tick = tokio::time::interval(BAR);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    loop {
        tick.tick().await;
        if screen.hub.is_heard() {
            let shared = screen.clone();
            let _ = tokio::task::spawn_blocking(move || shared.hub.tell(&Event::Bar(shared.bar()))).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{Cell, Event as Happened};
    use crate::web::guard::Tab;
    use crate::web::motion::Session;
    use crate::web::simulated::{SimulatedOptions, simulated};
    use sheetlight::arm::rules::{Confirmation, Plan};
    use sheetlight::arm::{Motion, Way};
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::sync::mpsc::channel;
    use std::time::Instant;

    /// Number of viewers; of further requests per viewer; of idle connections.
    const VIEWERS: usize = 50;
    const GALLERY: usize = 6;
    const IDLE: usize = 300;
    /// Longest wait for an answer; the sleeping workers never wake within it.
    const PATIENCE: Duration = Duration::from_secs(30);
    /// Speed at which a motion takes longer than any STOP, mm/s.
    const SLOWLY: f64 = 20.0;

    struct Client(String);

    impl Client {
        /// Sends a request; the caller may read the answer.
        fn sends(&self, method: &str, path: &str, more: &str) -> TcpStream {
            let mut stream = TcpStream::connect(&self.0).unwrap();
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
            let host = &self.0;
            let head = format!("{method} {path} HTTP/1.1\r\nhost: {host}\r\nauthorization: Bearer token\r\n");
            stream.write_all(format!("{head}x-sheetlight-tab: a\r\n{more}\r\n").as_bytes()).unwrap();
            stream
        }

        /// The first line of an answer.
        fn asks(&self, method: &str, path: &str) -> String {
            let mut answer = [0; 64];
            let read = self.sends(method, path, "content-length: 0\r\n").read(&mut answer).unwrap();
            String::from_utf8_lossy(&answer[..read]).lines().next().unwrap_or("").to_owned()
        }
    }

    /// Time of the first matching entry of the cell's log after this many entries.
    fn when(cell: &Cell, known: usize, what: impl Fn(&Happened) -> bool) -> f64 {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some(entry) = cell.log_after(known).iter().find(|e| what(&e.event)) {
                return entry.t_s;
            }
            assert!(Instant::now() < until, "not within {PATIENCE:?}");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// A job's slow motion that another thread halts; returns why it ended.
    fn moves(desk: &Desk) -> String {
        desk.looked().unwrap();
        let mut session = Session::begin(desk, "0001-insert", &Arc::default()).unwrap();
        let guard = session.guard();
        let mut to = guard.link().pose().unwrap().base_from_flange;
        to.translation.y -= to.translation.y.signum() * 200.0;
        let leg = Motion { to, way: Way::Straight, speed_mm_s: SLOWLY };
        let proposal = guard.propose(Plan::single("test", "to be halted", leg)).unwrap();
        assert!(proposal.passed(), "{:?}", proposal.missed());
        let yes = Confirmation::of(&*proposal.hash);
        guard.make(&proposal, yes, &mut |_, _| Ok(())).unwrap_err().what
    }

    /// STOP reaches the controller although every worker sleeps without end, viewers wait for their galleries, and
    /// more connections than slots are idle. Pages are answered meanwhile. The time depends on the machine: it is
    /// printed, and checked only in the long test.
    #[test]
    fn stop_reaches_the_controller_whatever_else_is_asked() {
        let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
        let dir = tempfile::tempdir().unwrap();
        let made = SimulatedOptions { shots: 1, sets: vec![], part: "osc".into(), seed: 3, speed: 1.0 };
        let (station, robot) = simulated(dir.path(), &made, &|_, _| {}).unwrap();
        let (cell, uri) = (robot.cell().clone(), robot.robot_uri());
        let (hub, place) =
            (Arc::new(Hub::default()), Place { recordings: dir.path().into(), station, mode: Mode::Simulated });
        sheetlight::files::make_folder(&place.jobs()).unwrap();
        let options = ServeOptions {
            station: place.station.clone(),
            recordings: place.recordings.clone(),
            mode: place.mode,
            address: IpAddr::from([127, 0, 0, 1]),
            port: 0,
            next_free: false,
            camera: None,
            robot: Some(uri.clone()),
            may_move: true,
            secured: None,
            metrics: None,
            mqtt: None,
            modbus: None,
            stop: Arc::default(),
        };
        let links = Links {
            station: place.station.clone(),
            robot: Some(uri),
            may_move: true,
            simulated: Some(robot),
            ..Links::default()
        };
        let desk = Arc::new(Desk::new(links, hub.clone()));
        desk.arm(&Tab { session: "token".into(), tab: "a".into() }).unwrap();
        let jobs = Jobs::open(place, hub, desk.clone()).unwrap();
        let (runtime, (tell, told)) = (runtime().unwrap(), channel());
        runtime.spawn(async move {
            let ready = |opened: &Opened| {
                tell.send(opened.url.to_owned()).unwrap();
                Ok(())
            };
            run(&options, "token", jobs, ready).await.unwrap();
        });
        let url = told.recv_timeout(PATIENCE).unwrap();
        let client = Client(url["http://".len()..].split('/').next().unwrap().to_owned());

        // Every worker sleeps. The first bar may still be made, because it comes before them.
        let (asleep, sleeping) = channel();
        let wake: Vec<_> = (0..WORKERS)
            .map(|_| {
                let ((wake, sleeps), asleep) = (channel::<()>(), asleep.clone());
                runtime.spawn_blocking(move || {
                    asleep.send(()).unwrap();
                    sleeps.recv()
                });
                wake
            })
            .collect();
        (0..WORKERS).for_each(|_| sleeping.recv_timeout(PATIENCE).unwrap());
        let upgrade = "upgrade: websocket\r\nconnection: upgrade\r\nsec-websocket-version: 13\r\n\
                       sec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n";
        let mut viewers = Vec::new();
        for _ in 0..VIEWERS {
            let mut socket = client.sends("GET", "/api/v1/events", upgrade);
            let mut answer = [0; 12];
            socket.read_exact(&mut answer).unwrap();
            assert_eq!(&answer, b"HTTP/1.1 101");
            viewers.push(socket);
            let picture = |k: usize| client.sends("GET", &format!("/api/v1/picture?recording=scan&frame={k}"), "");
            viewers.extend((0..GALLERY).map(picture));
        }
        let idle: Vec<TcpStream> = (0..IDLE).map(|_| TcpStream::connect(&client.0).unwrap()).collect();

        let mut took_ms: Vec<f64> = (0..if long { 20 } else { 5 })
            .filter_map(|_| {
                let known = cell.log().len();
                std::thread::scope(|scope| {
                    let moving = scope.spawn(|| moves(&desk));
                    when(&cell, known, |e| matches!(e, Happened::Move { .. }));
                    std::thread::sleep(Duration::from_millis(100));
                    let pressed = cell.clock().now();
                    assert_eq!(client.asks("POST", "/api/v1/stop"), "HTTP/1.1 200 OK");
                    let halted = when(&cell, known, |e| matches!(e, Happened::Halt { moving: true, .. }));
                    // If the machine stalls for seconds, the link's silence may halt the arm first.
                    (moving.join().unwrap() == "STOP was pressed").then_some((halted - pressed) * 1e3)
                })
            })
            .collect();
        took_ms.sort_by(f64::total_cmp);
        assert!(!took_ms.is_empty(), "no motion was halted by STOP");
        let page = Instant::now();
        for path in ["/", "/api/v1/motion", "/api/v1/jobs"] {
            assert_eq!(client.asks("GET", path), "HTTP/1.1 200 OK", "{path}");
        }
        let page = page.elapsed();
        println!("STOP at the controller after {took_ms:.1?} ms; three pages in {page:.1?}");
        assert!(!long || *took_ms.last().unwrap() <= 50.0, "{took_ms:?} ms");
        drop((wake, idle, viewers));
    }
}
