//! Messages and services of ROS 2, without ROS. In: MCAP with messages of ROS 2, from a file or a pipe; or a station.
//! Out: the same messages, or the station's state and jobs, over Zenoh, in the form that rmw_zenoh reads.
//!
//! Data flows one way: `stream` (records) -> `relay` (`definition` -> `hash`, `cdr`, `qos`, `names`) -> `door` (Zenoh).
//! In place of a stream, `station` feeds the door, and answers its calls.

mod cdr;
mod definition;
mod door;
mod fault;
mod hash;
mod names;
mod options;
mod pace;
mod qos;
mod relay;
mod station;
mod stream;

use clap::Parser;
use door::Door;
use fault::{Fault, fault};
use options::{HERE, Options};
use pace::Pace;
use relay::{Account, Relay};
use station::Wanted;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use stream::Stream;

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("{fault}");
            ExitCode::from(fault.code)
        }
    }
}

fn run(options: &Options) -> Result<(), Fault> {
    let wrong = |what: &str, cause, next| Fault { code: 2, ..fault(what, cause, next) };
    let domain = options.domain().map_err(|what| wrong(&what, "the environment has it", "give --domain"))?;
    if options.is_live() && options.rate.is_some() {
        let what = "--rate has no meaning for standard input, whose messages are sent as they come";
        return Err(wrong(what, "a file was meant", "name the file in place of -, or leave --rate away"));
    }
    let ending = ending()?;
    let stop = move || ending.load(Ordering::Relaxed);
    let stream = options.input.as_deref().map(Stream::open).transpose()?;
    let mut door = Door::open(options, domain)?;
    let at = options.listen.as_ref().map(|a| format!("listening on {a}"));
    let at = at.unwrap_or_else(|| format!("router {}", options.connect.as_deref().unwrap_or(HERE)));
    say(&format!("ROS 2 domain {domain}, {at}"));
    let Some(mut stream) = stream else {
        let went = station::serve(&mut door, &wanted(options), &stop);
        door.close();
        return went;
    };
    let pace = (!options.is_live()).then(|| Pace::new(options.rate.unwrap_or(1.0)));
    let (account, went, topics) = Relay::new(&mut door, pace, options.delay, &stop).run(&mut stream);
    told(&account);
    while options.stay && went.is_ok() && !stop() {
        std::thread::sleep(Duration::from_millis(200));
        door.look();
    }
    drop(topics);
    door.close();
    went?;
    match account.wrong {
        0 => Ok(()),
        n => Err(fault(
            format!("{n} messages were not sent, because they are not of their channel's type"),
            "the program that wrote them gave them another definition",
            "the first of each channel is named above",
        )),
    }
}

/// What is shown of a station.
fn wanted(options: &Options) -> Wanted<'_> {
    Wanted {
        address: options.station.as_deref().unwrap_or_default(),
        recipes: &options.recipe,
        recordings: &options.recording,
        notation: options.notation,
        frame: &options.frame,
    }
}

/// The account, one line a topic.
fn told(account: &Account) {
    for count in &account.counts {
        say(&format!("{:<24} {:>6}  {}", count.topic, count.sent, count.kind));
    }
    if account.skipped > 0 {
        say(&format!("{} messages of other channels were not sent", account.skipped));
    }
}

/// Prints a line. Messages are sent also if nobody reads what is printed.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Becomes true at Ctrl-C, or at the end of the session.
fn ending() -> Result<Arc<AtomicBool>, Fault> {
    let ending = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        // A second Ctrl-C ends at once.
        signal_hook::flag::register_conditional_shutdown(signal, 1, ending.clone())
            .and_then(|_| signal_hook::flag::register(signal, ending.clone()))
            .map_err(|e| fault(format!("no signals: {e}"), "the system refuses them", "start it again"))?;
    }
    Ok(ending)
}
