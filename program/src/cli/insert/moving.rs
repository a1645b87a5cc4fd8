//! In: the common options of commands that move a robot: station, robot, camera, speed, permission to move. Out:
//! the robot behind its rules, taken; the person at the terminal, who is asked before each motion.
//! Frame and unit: mm/s.

use crate::cli::terminal::console::Console;
use crate::cli::terminal::interrupt;
use sheetlight::arm::rules::{Confirmation, Guard};
use sheetlight::capture::CameraUri;
use sheetlight::fault::{Fault, Result};
use sheetlight::station::guarded;
use sheetlight::station::job::{Ask, Operator};
use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;

/// A robot with a camera that may be moved.
#[derive(clap::Args)]
pub(in crate::cli) struct Moving {
    /// Station folder; station.toml needs [motion], [outputs] and [tool] (docs/robots.md)
    #[arg(long)]
    pub station: PathBuf,
    /// The robot: bcap://HOST[:5007][?network=udp][&full=MM_S][&turn=DEG_S] (docs/robots.md)
    #[arg(long)]
    pub robot: String,
    /// The camera (docs/live.md)
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<CameraUri>)]
    pub camera: CameraUri,
    /// Allow robot motion
    #[arg(long)]
    pub allow_motion: bool,
    /// Speed of every motion, mm/s, up to the station's [default: the station's, else 50]
    #[arg(long)]
    pub speed: Option<f64>,
    /// Confirm every motion automatically; simulated cells only
    #[arg(long)]
    pub yes: bool,
}

impl Moving {
    /// The robot behind its rules, taken for motions. Ctrl-C halts it; the station's motions.jsonl logs requests
    /// and motions.
    ///
    /// # Errors
    /// `--yes` for a robot that does not report that it is simulated; no permission to move; no controller.
    pub fn guard(&self) -> Result<Guard> {
        let mut guard = guarded(&self.station, &self.robot)?;
        // A local address proves nothing: a tunnel to a real controller has one too.
        if self.yes && !guard.link().simulated()? {
            return Err(Fault::usage(format!("--yes with the robot {}", self.robot))
                .cause(
                    "its controller does not say that it is a simulated one, and only such a robot moves without \
                        a person's yes",
                )
                .next("leave --yes out"));
        }
        guard.stop_button().listen(interrupt::asked_for());
        guard.arm(self.allow_motion)?;
        Ok(guard)
    }

    /// The person who is responsible for the motions.
    pub fn person<'a>(&self, console: &'a Console) -> Person<'a> {
        Person { console, yes: self.yes }
    }
}

/// The person at the terminal.
pub(in crate::cli) struct Person<'a> {
    console: &'a Console,
    /// Every question is answered with yes: the robot is simulated.
    yes: bool,
}

impl Person<'_> {
    fn answered(&self, question: &str) -> Result<bool> {
        if self.yes {
            return Ok(true);
        }
        if !std::io::stdin().is_terminal() {
            return Err(Fault::usage(format!("nobody can answer '{question}': standard input is not a terminal"))
                .next("run it in a terminal"));
        }
        self.console.ask(&format!("   {question} [y/N] "));
        let mut line = String::new();
        let read = std::io::stdin().lock().read_line(&mut line);
        read.map_err(|e| Fault::input(format!("standard input: {e}")).next("run it in a terminal"))?;
        Ok(matches!(line.trim(), "y" | "Y" | "yes"))
    }
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
        for what in &ask.proposal.unjudged {
            words += &format!("\n   not judged: {what}");
        }
        self.console.say(words);
        Ok(self.answered(ask.question)?.then(|| Confirmation::of(&*ask.proposal.hash)))
    }

    fn looked(&mut self, why: &str) -> Result<bool> {
        self.console.say(why);
        self.answered("have you looked at the robot?")
    }

    fn tell(&mut self, line: &str) {
        self.console.say(line);
    }
}
