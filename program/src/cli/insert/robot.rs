//! In: a station, a camera, recipes, an address. Out: answers to the requests of a robot's own program or of a PLC
//! over TCP, until Ctrl-C.
//! Frame and unit: poses in the robot's own notation.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use sheetlight::capture::CameraUri;
use sheetlight::fault::{Fault, Result};
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::socket::{Patience, Session, SocketOptions, serve, serve_modbus};
use sheetlight::station::{Output, Settings, guarded, try_output};
use std::net::TcpListener;
use std::path::PathBuf;
use std::time::Duration;

#[derive(clap::Subcommand)]
pub enum Command {
    Serve(Serve),
    Output(TryOutput),
}

/// Test an output of a linked controller: lasers and lamp for 1.5 s, or the gripper
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight robot output line --station cell3 --robot bcap://192.168.0.1:5007 --allow-motion
Guide: docs/robots.md")]
pub struct TryOutput {
    /// line, pointer, room, open or close
    #[arg(value_parser = crate::cli::terminal::arguments::parse::<Output>)]
    output: Output,
    /// Station folder; [outputs] of station.toml states the numbers
    #[arg(long)]
    station: PathBuf,
    /// The robot: bcap://HOST[:5007]
    #[arg(long)]
    robot: String,
    /// Allow taking the arm; somebody stands beside the cell
    #[arg(long)]
    allow_motion: bool,
}

fn output(args: &TryOutput, console: &Console) -> Result<()> {
    let settings = Settings::load(&args.station)?;
    let mut guard = guarded(&args.station, &args.robot)?;
    // From here on a signal ends the wait instead of ending the program with the laser on.
    let stop = interrupt::asked_for();
    guard.arm(args.allow_motion)?;
    let number = try_output(guard.link(), &settings.outputs.unwrap_or_default(), args.output, &stop)?;
    console.result(&number, &format!("output {number} was switched"));
    Ok(())
}

#[derive(Clone, Copy, Default, PartialEq, clap::ValueEnum)]
enum Protocol {
    #[default]
    Lines,
    Modbus,
}

/// Answer a robot's own program or a PLC over a TCP socket
///
/// For controllers that are not linked. The robot's program moves the arm, switches the line, and sends the flange
/// pose at each stop. Sheetlight takes the pictures and answers with poses in the robot's notation. One program at a
/// time. docs/robots/README.md has the lines and programs for UR, KUKA, FANUC, ABB and Denso; docs/connections.md has
/// the registers of Modbus. Sheetlight moves no robot here.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight robot serve --station cell3 --camera gige://first --recipes data/recipes \\
      --notation ur --listen 0.0.0.0:5050 --out scans
Guide: docs/robots.md")]
pub struct Serve {
    /// Station folder; station.toml needs [tool] for poses of the flange
    #[arg(long)]
    station: PathBuf,
    /// The camera (docs/live.md)
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<CameraUri>)]
    camera: CameraUri,
    /// Folder of recipes; FIND led uses led.toml
    #[arg(long)]
    recipes: PathBuf,
    /// Folder for the scans
    #[arg(long)]
    out: PathBuf,
    /// Address and port to listen on; anybody who reaches it can send requests
    #[arg(long, default_value = "127.0.0.1:5050")]
    listen: String,
    /// Notation of the poses (docs/conventions.md) [default: the station's]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Convention>)]
    notation: Option<Convention>,
    /// Lines of text, or registers of Modbus TCP
    #[arg(long, value_enum, default_value_t)]
    protocol: Protocol,
    /// Disconnect a program after this silence, or let another PLC write, s, 1 to 86400
    #[arg(long, default_value_t = 600.0)]
    patience: f64,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = crate::cli::terminal::arguments::parse::<Where>)]
    on: Where,
}

pub fn run(command: &Command, console: &Console) -> Result<()> {
    let args = match command {
        Command::Serve(args) => args,
        Command::Output(args) => return output(args, console),
    };
    if !(1.0..=86_400.0).contains(&args.patience) {
        return Err(
            Fault::usage(format!("--patience {}, 1 to 86400 s are allowed", args.patience)).next("correct the option")
        );
    }
    let notation = args.notation.or(Settings::load(&args.station)?.robot).ok_or_else(|| {
        Fault::usage("the robot's notation is not known")
            .cause("neither --notation nor station.toml's robot names it, and it is never guessed")
            .next("give --notation, for example ur")
    })?;
    let listener = TcpListener::bind(&args.listen).map_err(|e| {
        Fault::device(format!("{}: cannot be listened on: {e}", args.listen))
            .cause("another program has the port, or the address is not this machine's")
            .next("choose another --listen")
    })?;
    let at = listener.local_addr().map_or_else(|_| args.listen.clone(), |a| a.to_string());
    let options = SocketOptions {
        station: args.station.clone(),
        recipes: args.recipes.clone(),
        out: args.out.clone(),
        notation,
        place: args.on,
    };
    let mut session = Session::new(options, args.camera.open(None)?)?;
    console.result(
        &serde_json::json!({ "listens": at, "notation": notation.name() }),
        &format!("listens on {at}, poses in the notation {}", notation.name()),
    );
    let patience = Patience { idle: Duration::from_secs_f64(args.patience), ..Patience::default() };
    let stop = interrupt::asked_for();
    let mut told = |line: &str| console.say(line);
    match args.protocol {
        Protocol::Modbus => serve_modbus(&listener, &mut session, patience, &stop, &mut told),
        Protocol::Lines => serve(&listener, &mut session, patience, &stop, &mut told)
            .map_err(|e| Fault::device(format!("{at}: {e}")).next("start it again")),
    }
}
