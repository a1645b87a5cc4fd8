//! In: a station folder, an address. Out: the operator's screen, served until Ctrl-C; a password's hash for other
//! machines.
//! Frame and unit: as the screen's procedures.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::web::{
    Broker, Mode, Names, Secured, ServeOptions, SimulatedOptions, SimulatedRobot, hashed, random_hex, serve, simulated,
};
use sheetlight::fault::{Fault, Result};
use sheetlight::scan::RawFormat;
use sheetlight::simulate::Set;
use std::io::{BufRead, IsTerminal};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

/// Serve the operator's screen to a browser
///
/// Prints the address to open. It holds a token of this start, so nobody else on the machine gets in. Everything on
/// the pages is a procedure that the command line has too. Jobs are stored in the station's folder and survive a
/// restart.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight station serve --station demo-cell --simulate
  sheetlight station serve --station cell3 --recordings recordings
  sheetlight station serve --station cell3 --listen 0.0.0.0 --name cell3.plant \\
      --password-file pw --tls-cert cert.pem --tls-key key.pem
Guide: docs/operator.md")]
pub struct Serve {
    /// Station folder; a new one with --simulate
    #[arg(long)]
    station: PathBuf,
    /// Folder of recordings [default: the folder with the station]
    #[arg(long)]
    recordings: Option<PathBuf>,
    /// Start a simulated cell with camera and robot, and its station
    #[arg(long, conflicts_with = "recordings")]
    simulate: bool,
    /// Component in the simulated gripper: led, osc, flash or dimm
    #[arg(long, default_value = "osc", requires = "simulate")]
    part: String,
    /// Random seed of the simulated cell
    #[arg(long, default_value_t = 3, requires = "simulate")]
    seed: u64,
    /// Simulation speed factor, 0.1 to 1000
    #[arg(long, default_value_t = 1.0, requires = "simulate")]
    speed: f64,
    /// Shots of the simulated scan; below about 100 the parts are too coarse to be found
    #[arg(long, default_value_t = 200, requires = "simulate")]
    shots: usize,
    /// Recordings to simulate, separated by commas: scan, intrinsics, handeye, ..., all, none
    #[arg(long = "set", value_delimiter = ',', default_value = "all", requires = "simulate")]
    sets: Vec<String>,
    /// Camera, e.g. gige://first, or - with --raw (docs/live.md)
    #[arg(long, conflicts_with = "simulate")]
    camera: Option<String>,
    /// Raw frames on standard input: WIDTHxHEIGHT:gray8, gray10le, gray12le or gray16le
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<RawFormat>, requires = "camera")]
    raw: Option<RawFormat>,
    /// Robot, e.g. bcap://10.0.0.2; moves only with --allow-motion
    #[arg(long, conflicts_with = "simulate")]
    robot: Option<String>,
    /// Allow robot motion; each motion is shown first and runs only while a button is held
    #[arg(long)]
    allow_motion: bool,
    /// Port; 0: any [default: 8620, or the next free one]
    #[arg(long)]
    port: Option<u16>,
    /// Address to listen on; any but 127.0.0.1 needs a password and TLS
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), requires_ifs = [("0.0.0.0", "password_file")])]
    listen: IpAddr,
    /// Password's hash, from sheetlight station password
    #[arg(long, value_name = "FILE", requires_all = ["tls_cert", "tls_key"])]
    password_file: Option<PathBuf>,
    /// TLS certificate chain, PEM
    #[arg(long, value_name = "FILE", requires_all = ["password_file", "tls_key"])]
    tls_cert: Option<PathBuf>,
    /// TLS private key, PEM
    #[arg(long, value_name = "FILE", requires_all = ["password_file", "tls_cert"])]
    tls_key: Option<PathBuf>,
    /// Token, 20 characters or more, that only reads /api/v1/metrics
    #[arg(long, value_name = "FILE")]
    metrics_token_file: Option<PathBuf>,
    /// MQTT broker for state and results: mqtt://HOST or mqtts://HOST
    #[arg(long, value_name = "URI")]
    mqtt: Option<String>,
    /// First topic levels [default: sheetlight/ and the folder's name]
    #[arg(long, value_name = "TOPIC", requires = "mqtt")]
    mqtt_topic: Option<String>,
    /// Publish Sparkplug B instead of JSON, as this node of a group
    #[arg(long, value_name = "GROUP/NODE", requires = "mqtt", conflicts_with = "mqtt_topic")]
    mqtt_sparkplug: Option<String>,
    /// Name and password for the broker, on two lines
    #[arg(long, value_name = "FILE", requires = "mqtt")]
    mqtt_login: Option<PathBuf>,
    /// PEM certificates that sign the broker's [default: the system's]
    #[arg(long, value_name = "FILE", requires = "mqtt")]
    mqtt_ca: Option<PathBuf>,
    /// Registers for a PLC (Modbus TCP, no login): PORT of this machine, or ADDRESS:PORT
    #[arg(long, value_name = "ADDR", value_parser = modbus)]
    modbus: Option<SocketAddr>,
    /// Name by which browsers call this machine; may be repeated
    #[arg(long = "name", requires = "password_file")]
    names: Vec<String>,
}

/// Hash a password for station serve --password-file
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight station password --out cell3/screen.password
Guide: docs/operator.md")]
pub struct Password {
    /// File for the hash; the password is prompted for, or read from standard input
    #[arg(long)]
    out: PathBuf,
}

/// The default port of the screen.
const PORT: u16 = 8620;

pub fn run(args: &Serve, console: &Console) -> Result<()> {
    let (station, mode, cell) = match args.simulate {
        true => make(args, console).map(|(station, cell)| (station, Mode::Simulated, Some(cell)))?,
        false => (args.station.clone(), Mode::Replay, None),
    };
    let holder = || match station.canonicalize() {
        Ok(real) => real.parent().unwrap_or(Path::new("/")).to_owned(),
        Err(_) => station.clone(),
    };
    let recordings = args.recordings.clone().unwrap_or_else(holder);
    let secured = match (&args.password_file, &args.tls_cert, &args.tls_key) {
        (Some(password), Some(certificates), Some(key)) => Some(Secured {
            password: sheetlight::files::read_text(password)?,
            certificates: certificates.clone(),
            key: key.clone(),
            names: args.names.clone(),
        }),
        _ => None,
    };
    let options = ServeOptions {
        station,
        recordings,
        mode: if args.camera.is_some() { Mode::Live } else { mode },
        address: args.listen,
        port: args.port.unwrap_or(PORT),
        next_free: true,
        camera: cell.as_ref().map(|c| (c.camera_uri(), None)).or(args.camera.clone().map(|uri| (uri, args.raw))),
        robot: cell.as_ref().map(SimulatedRobot::robot_uri).or(args.robot.clone()),
        may_move: args.allow_motion || cell.is_some(),
        secured,
        metrics: args.metrics_token_file.as_deref().map(metrics_token).transpose()?,
        mqtt: broker(args)?,
        modbus: args.modbus,
        stop: interrupt::asked_for(),
    };
    serve(&options, cell, &random_hex(), |opened| {
        opened.instead.into_iter().for_each(|why| console.warn(why));
        if let Some(at) = opened.modbus.filter(|at| !at.ip().is_loopback()) {
            console.warn(format!("anybody who reaches {at} can ask for jobs and stop them: Modbus has no login"));
        }
        let url = opened.url;
        let mut told = serde_json::json!({ "url": url });
        let mut said =
            format!("open {url}\nthe address holds the token of this start; Ctrl-C ends the screen, jobs are kept");
        if let Some(at) = opened.modbus {
            told["modbus"] = at.to_string().into();
            said += &format!("\nregisters for a PLC: Modbus TCP at {at}");
        }
        console.result(&told, &said);
        console.finish()
    })
}

/// The address of `--modbus`; a port alone is one of this machine that others do not reach.
fn modbus(text: &str) -> std::result::Result<SocketAddr, String> {
    let port = text.parse::<u16>().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    port.or_else(|_| text.parse()).map_err(|_| "wanted PORT or ADDRESS:PORT, e.g. 5020 or 192.168.0.10:502".into())
}

/// Most bytes of a file with certificates: those of a system have 0.3 MB.
const CA_BYTES: u64 = 4_000_000;

/// The MQTT broker that was named.
fn broker(args: &Serve) -> Result<Option<Broker>> {
    let Some(uri) = &args.mqtt else { return Ok(None) };
    // `.` has no name, the folder that it means has.
    let station = std::path::absolute(&args.station).unwrap_or_else(|_| args.station.clone());
    let folder = || station.file_name().map_or("station".into(), |n| n.to_string_lossy().into_owned());
    let topic = args.mqtt_topic.clone().unwrap_or_else(|| format!("sheetlight/{}", folder()));
    let login = args.mqtt_login.as_deref().map(sheetlight::files::read_text).transpose()?;
    let authority = args.mqtt_ca.as_deref().map(|file| sheetlight::files::read(file, CA_BYTES)).transpose()?;
    let broker = Broker::new(uri, &topic, login.as_deref(), authority.as_deref())?;
    let names = args.mqtt_sparkplug.as_deref().map(Names::new).transpose()?;
    Ok(Some(match names {
        Some(names) => broker.as_node(names),
        None => broker,
    }))
}

/// The token in a file. A short one could be guessed.
fn metrics_token(file: &Path) -> Result<String> {
    const LEAST: usize = 20;
    let token = sheetlight::files::read_text(file)?.trim().to_owned();
    if token.len() < LEAST || !token.chars().all(|c| c.is_ascii_graphic()) {
        return Err(Fault::usage(format!(
            "{}: the token has {} characters, {LEAST} printable ones are the least",
            file.display(),
            token.len()
        ))
        .next("write another one, for example with: openssl rand -hex 32"));
    }
    Ok(token)
}

fn make(args: &Serve, console: &Console) -> Result<(PathBuf, SimulatedRobot)> {
    let mut sets = Vec::new();
    for name in &args.sets {
        match name.as_str() {
            "all" => sets.extend(Set::ALL),
            "none" => {}
            name => sets.push(name.parse().map_err(|e: String| Fault::usage(e).next("name a set"))?),
        }
    }
    let bar = console.bar("simulating a station", 0);
    let options =
        SimulatedOptions { shots: args.shots, sets, part: args.part.clone(), seed: args.seed, speed: args.speed };
    let made = simulated(&args.station, &options, &|n, of| {
        bar.set_length(of as u64);
        bar.set_position(n as u64);
    })?;
    bar.finish_and_clear();
    Ok(made)
}

pub fn password(args: &Password, console: &Console) -> Result<()> {
    let hash = hashed(&asked(console)?)?;
    sheetlight::files::write(&args.out, format!("{hash}\n").as_bytes())?;
    console.result(&serde_json::json!({ "written": args.out }), &format!("{}: written", args.out.display()));
    Ok(())
}

/// The password, typed twice without echo at a terminal, or a line of standard input.
fn asked(console: &Console) -> Result<String> {
    let unreadable = |e: std::io::Error| {
        Fault::input(format!("the password cannot be read: {e}")).next("type it, or send it to standard input")
    };
    if !std::io::stdin().is_terminal() {
        let mut line = String::new();
        std::io::stdin().lock().read_line(&mut line).map_err(unreadable)?;
        return Ok(line.trim_end_matches(['\r', '\n']).to_owned());
    }
    console.ask("password (it is not shown while you type): ");
    let first = rpassword::read_password().map_err(unreadable)?;
    console.ask("once more: ");
    if rpassword::read_password().map_err(unreadable)? != first {
        return Err(Fault::usage("the two passwords are not the same").next("type the same one twice"));
    }
    Ok(first)
}
