//! Sheetlight as a vision system for OPC UA clients [opc-mv, OPC 40100-1]. In: a station's Modbus door. Out: an OPC UA
//! server.
//!
//! Data flows one way: `sheetlight_registers` reads the station -> `vision` (states of `machine`, `results`) ->
//! `outlet` -> nodes. Calls flow back: `gate` -> the server -> `node` -> `vision` -> the station.

mod arguments;
mod calls;
mod gate;
mod machine;
mod model;
mod node;
mod options;
mod outlet;
mod results;
mod security;
mod vision;

use clap::Parser;
use node::Manager;
use opcua::server::{ServerBuilder, ServerHandle};
use opcua::types::BuildInfo;
use options::Options;
use outlet::Outlet;
use sheetlight_registers::{Seen, Station};
use std::io::Read;
use std::net::SocketAddr;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tokio::net::TcpListener;
use vision::Vision;

/// Most sessions. A connection has one; one that was cut off keeps its session until that ends.
const SESSIONS: usize = 24;
/// A session that is silent ends.
const SESSION_MS: u64 = 60_000;
/// Sampling and publishing.
const FASTEST_MS: f64 = 50.0;
/// Most bytes of a login file that are read.
const MOST_BYTES: u64 = 4096;

/// What ends the program: what happened, the likely cause, the next step.
struct Fault {
    code: u8,
    what: String,
    cause: &'static str,
    next: &'static str,
}

fn fault(what: impl Into<String>, cause: &'static str, next: &'static str) -> Fault {
    Fault { code: 1, what: what.into(), cause, next }
}

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Fault { code, what, cause, next }) => {
            eprintln!("error: {what}\n  likely cause: {cause}\n  next step: {next}");
            ExitCode::from(code)
        }
    }
}

fn run(options: &Options) -> Result<(), Fault> {
    let loopback = options.is_loopback().map_err(|what| Fault {
        code: 2,
        ..fault(what, "without them anybody in the network starts and stops jobs", "give both, or listen on 127.0.0.1")
    })?;
    let login = options.login.as_deref().map(read_login).transpose()?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime
        .map_err(|e| fault(format!("no threads: {e}"), "the system has no thread left", "close other programs"))?;
    runtime.block_on(served(options, loopback, login))
}

fn read_login(path: &Path) -> Result<(String, String), Fault> {
    let wrong = |e: String| {
        fault(
            format!("--login {}: {e}", path.display()),
            "the file is missing, cannot be read, or lacks a line",
            "write the name on its first line and the password on its second",
        )
    };
    let mut text = String::new();
    let file = std::fs::File::open(path).map_err(|e| wrong(e.to_string()))?;
    file.take(MOST_BYTES).read_to_string(&mut text).map_err(|e| wrong(e.to_string()))?;
    security::login(&text).map_err(wrong)
}

async fn served(options: &Options, loopback: bool, login: Option<(String, String)>) -> Result<(), Fault> {
    let listen = &options.listen;
    let unheard = |e: std::io::Error| {
        fault(
            format!("--listen {}: cannot be listened on: {e}", listen.address),
            "another program has the port, the address is not this machine's, or the port needs rights",
            "choose another address or port; ports from 1024 on need no rights",
        )
    };
    let public = TcpListener::bind(listen.address).await.map_err(unheard)?;
    let port = public.local_addr().map_err(unheard)?.port();
    // The server itself is reached by this program alone; the gate is in front of it.
    let inner = TcpListener::bind(("127.0.0.1", 0)).await.map_err(unheard)?;
    let inside = inner.local_addr().map_err(unheard)?;

    let scratch = tempfile::tempdir().map_err(|e| {
        fault(format!("no temporary folder: {e}"), "the disk is full or cannot be written", "free some room")
    })?;
    let pki = options.pki.as_deref().unwrap_or(scratch.path());
    security::make_folder(pki).map_err(|e| {
        fault(
            format!("--pki {}: {e}", pki.display()),
            "the folder above it is missing or cannot be written",
            "name a folder that can be made",
        )
    })?;
    let vision = Vision::new(options.recipe.clone(), tokio::runtime::Handle::current());
    let builder = built(&listen.host, port).with_node_manager(node::nodes(vision.clone()));
    let builder = builder.with_type_loader(Arc::new(model::data::Loader));
    let (server, handle) = security::secured(builder, options, loopback, login, pki).build().map_err(|e| {
        fault(format!("the server cannot be set up: {e}"), "certificates or login are wrong", "check --pki and --login")
    })?;
    if options.pki.is_some() && handle.info().server_certificate.is_none() {
        return Err(fault(
            format!("--pki {}: there is no usable certificate and private key in it", pki.display()),
            "own/cert.der or private/private.pem is damaged, or the folder cannot be written",
            "remove both files, and a new pair is made",
        ));
    }
    let manager: Arc<Manager> = handle.node_managers().get_of_type().expect("the nodes were added above");
    let serving = tokio::spawn(server.run_with(inner));
    advertised(&handle, inside, port).await;

    let spaces = manager.inner().spaces;
    let outlet = Outlet::new(manager, handle.subscriptions().clone(), spaces);
    begin(options, &vision, outlet)?;
    println!("OPC UA at opc.tcp://{}:{port}/ for the station at {}", listen.host, options.station);
    tokio::select! {
        () = gate::serve(public, inside) => {}
        _ = serving => return Err(fault("the server ended", "a fault of this program", "start it again and report it")),
        () = told_to_end() => {}
    }
    // Clients notice that their connections close; sessions end with the program.
    Ok(())
}

/// The server without its doors: name, limits.
fn built(host: &str, port: u16) -> ServerBuilder {
    let mut builder = ServerBuilder::new()
        .application_name("Sheetlight")
        .application_uri("urn:sheetlight:opcua")
        .product_uri("urn:sheetlight")
        .host(host)
        .port(port)
        .discovery_urls(vec![format!("opc.tcp://{host}:{port}/")])
        .build_info(BuildInfo {
            product_uri: "urn:sheetlight".into(),
            manufacturer_name: "Sheetlight".into(),
            product_name: "Sheetlight".into(),
            software_version: env!("CARGO_PKG_VERSION").into(),
            ..BuildInfo::default()
        })
        .max_sessions(SESSIONS)
        .max_session_timeout_ms(SESSION_MS)
        .hello_timeout(5)
        .max_message_size(gate::MOST_BYTES);
    let limits = builder.limits_mut();
    // What one session may hold. All sessions together then hold some megabytes.
    limits.subscriptions.max_subscriptions_per_session = 4;
    // A subscription outlives its session by this number of its intervals.
    limits.subscriptions.max_keep_alive_count = 1200;
    limits.subscriptions.max_lifetime_count = 3600;
    limits.subscriptions.max_monitored_items_per_sub = 200;
    limits.subscriptions.max_monitored_item_queue_size = 20;
    limits.subscriptions.max_queued_notifications = 20;
    limits.subscriptions.max_notifications_per_publish = 100;
    limits.subscriptions.min_publishing_interval_ms = FASTEST_MS;
    limits.subscriptions.min_sampling_interval_ms = FASTEST_MS;
    limits.operational.max_nodes_per_read = 1000;
    limits.operational.max_nodes_per_method_call = 4;
    limits.operational.max_monitored_items_per_call = 200;
    limits.max_browse_continuation_points = 20;
    limits.max_history_continuation_points = 1;
    limits.max_query_continuation_points = 1;
    builder.config_mut().subscription_poll_interval_ms = FASTEST_MS as u64;
    builder
}

/// Waits until the server listens, then has it name the public port in its endpoints.
async fn advertised(handle: &ServerHandle, inside: SocketAddr, port: u16) {
    while handle.info().port.load(Ordering::Relaxed) != inside.port() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    handle.info().port.store(port, Ordering::Relaxed);
}

/// Begins to talk to the station.
fn begin(options: &Options, vision: &Arc<Vision>, outlet: Outlet) -> Result<(), Fault> {
    let (sees, mut lost) = (vision.clone(), None::<String>);
    let address = options.station.clone();
    let told = move |what: Result<Seen, String>| {
        match &what {
            Ok(_) if lost.take().is_some() => eprintln!("the station {address} is reached again"),
            Err(why) if lost.as_ref() != Some(why) => {
                eprintln!("the station {address} is not reached: {why}; it is tried again every second");
                lost = Some(why.clone());
            }
            _ => {}
        }
        sees.saw(what);
    };
    let station = Station::begin(options.station.clone(), told)
        .map_err(|e| fault(format!("no thread: {e}"), "the system has no thread left", "close other programs"))?;
    vision.connect(station, Box::new(move |values, told| outlet.show(values, told)));
    Ok(())
}

/// Ctrl-C, or the end of a session.
async fn told_to_end() {
    use tokio::signal::unix::{SignalKind, signal};
    let (Ok(mut interrupt), Ok(mut terminate)) = (signal(SignalKind::interrupt()), signal(SignalKind::terminate()))
    else {
        return std::future::pending().await;
    };
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
    }
}
