//! In: what every command that moves a robot is told: station, robot, camera, speed, leave to move. Out: the robot behind its rules,
//! taken; the person at the terminal, who is asked before each motion.
//! Frame and unit: mm/s.

use crate::arm::rules::{Confirmation, Guard, MotionLog};
use crate::capture::CameraUri;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use crate::fault::{Fault, Result};
use crate::station::Settings;
use crate::station::job::{Ask, Operator};
use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;

/// A robot with a camera that may be moved.
#[derive(clap::Args)]
pub(in crate::cli) struct Moving {
    /// Station folder; its station.toml states [motion], [outputs] and [tool] (docs/robots.md)
    #[arg(long)]
    pub station: PathBuf,
    /// The robot: bcap://HOST[:5007][?network=udp][&full=MM_S]
    #[arg(long)]
    pub robot: String,
    /// The camera (docs/live.md)
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<CameraUri>)]
    pub camera: CameraUri,
    /// The arm may move
    #[arg(long)]
    pub allow_motion: bool,
    /// Speed of every motion, mm/s, at most the station's [default: the station's, else 50]
    #[arg(long)]
    pub speed: Option<f64>,
    /// Say yes to every motion: for simulated cells on this machine alone
    #[arg(long)]
    pub yes: bool,
}

impl Moving {
    /// Refuses `--yes` for a robot that is not on this machine. Comes before anything is opened.
    pub fn check(&self) -> Result<()> {
        if self.yes && !on_this_machine(&self.robot) {
            return Err(Fault::usage(format!("--yes with the robot {}", self.robot))
                .cause("only a simulated cell on this machine may be moved without a person's yes")
                .next("leave --yes out"));
        }
        Ok(())
    }

    /// The robot behind its rules, taken for motions; Ctrl-C halts it, the station's motions.jsonl has what is asked and made.
    pub fn guard(&self, settings: &Settings) -> Result<Guard> {
        let log = MotionLog::file(&self.station.join("motions.jsonl"));
        let mut guard = Guard::new(crate::arm::open(&self.robot)?, settings.motion.clone(), log);
        guard.stop_button().listen(interrupt::asked_for());
        guard.arm(self.allow_motion)?;
        Ok(guard)
    }

    /// Whoever answers for the motions.
    pub fn person<'a>(&self, console: &'a Console) -> Person<'a> {
        Person { console, yes: self.yes }
    }
}

fn on_this_machine(uri: &str) -> bool {
    let host = uri.split_once("://").map_or("", |(_, rest)| rest);
    ["127.0.0.1:", "localhost:", "[::1]:"].iter().any(|h| host.starts_with(h))
}

/// Whoever sits at the terminal.
pub(in crate::cli) struct Person<'a> {
    console: &'a Console,
    /// Every motion is confirmed without asking.
    yes: bool,
}

impl Operator for Person<'_> {
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>> {
        let mut words = format!("{}:", ask.step);
        for line in &ask.says {
            words += &format!("\n   {line}");
        }
        let speed = ask.proposal.plan.legs.iter().map(|l| l.speed_mm_s).fold(0.0, f64::max);
        words += &format!(
            "\n   {} motions at {speed:.0} mm/s, {} gates met, pose {}",
            ask.proposal.plan.legs.len(),
            ask.proposal.gates.len(),
            &ask.proposal.hash[..12]
        );
        self.console.say(words);
        let yes = || Some(Confirmation::of(&*ask.proposal.hash));
        if self.yes {
            return Ok(yes());
        }
        if !std::io::stdin().is_terminal() {
            return Err(Fault::usage(format!("nobody can answer '{}': standard input is no terminal", ask.question))
                .next("run it in a terminal"));
        }
        self.console.ask(&format!("   {} [y/N] ", ask.question));
        let mut line = String::new();
        let read = std::io::stdin().lock().read_line(&mut line);
        read.map_err(|e| Fault::input(format!("standard input: {e}")).next("run it in a terminal"))?;
        Ok(if matches!(line.trim(), "y" | "Y" | "yes") { yes() } else { None })
    }

    fn tell(&mut self, line: &str) {
        self.console.say(line);
    }
}
