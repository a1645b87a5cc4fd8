//! In: a controller's address and calls. Out: the controller's answers; no wait exceeds its configured limit.
//! Frame and unit: as the controller writes them: mm and degrees, in Denso's notation.

use super::{Call, Exchange, Heard, Link, Network, Outcome, Variant};
use crate::fault::{Fault, Result};
use std::time::{Duration, Instant};

/// Waiting times of a connection.
#[derive(Clone, Copy, Debug)]
pub struct ClientOptions {
    /// Transport of the frames; TCP unless stated.
    pub network: Network,
    /// Longest silence within a call. Interim replies of this call end a silence, frames of other calls do not.
    pub patience: Duration,
    /// Time after which an unanswered datagram is sent again.
    pub repeat: Duration,
    /// Interval of the controller's interim replies, ms, at least 80; and the time limit that the controller sets
    /// for a call, ms. `None` leaves both to the controller: it sends no interim replies, and a motion must end
    /// within `patience`.
    pub watchdog_ms: Option<(u32, u32)>,
}

impl Default for ClientOptions {
    fn default() -> ClientOptions {
        ClientOptions {
            network: Network::Tcp,
            patience: Duration::from_secs(3),
            repeat: Duration::from_millis(200),
            watchdog_ms: Some((400, 180_000)),
        }
    }
}

/// An object of the controller: the controller itself, a robot or a variable. Valid only on the connection that
/// returned it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle(pub i32);

/// One connection with the service started.
pub struct Client {
    link: Link,
    exchange: Exchange,
    options: ClientOptions,
}

impl Client {
    /// Opens `host:port`; the first call must start the service.
    pub fn open(address: &str, options: ClientOptions) -> Result<Client> {
        let link = Link::open(address, options.network, options.patience)?;
        Ok(Client { link, exchange: Exchange::new(options.network == Network::Udp), options })
    }

    /// Opens `host:port` and starts the service.
    pub fn connect(address: &str, options: ClientOptions) -> Result<Client> {
        let mut client = Client::open(address, options)?;
        let words = match options.watchdog_ms {
            Some((every, longest)) => format!(",WDT={every},InvokeTimeout={longest}"),
            None => String::new(),
        };
        client.ask(Call::ServiceStart, vec![Variant::Text(words)])?;
        Ok(client)
    }

    /// Makes a call and waits for its answer. The inner result is the controller's: a value ([`Variant::Empty`] if
    /// the call returns none) or its refusal. Returns an error on silence, a closed connection or damaged data.
    pub fn call(&mut self, call: Call, arguments: Vec<Variant>) -> Result<std::result::Result<Variant, Outcome>> {
        let request = self.exchange.begin(call, arguments)?;
        self.link.send(&request)?;
        let repeats = self.options.network == Network::Udp;
        let mut silent_since = Instant::now();
        let mut repeat_at = silent_since + self.options.repeat;
        loop {
            let give_up = silent_since + self.options.patience;
            let until = if repeats { give_up.min(repeat_at) } else { give_up };
            match self.link.receive(until)?.map(|frame| self.exchange.hear(frame)) {
                Some(Heard::Answer(outcome, _)) if outcome.failed() => return Ok(Err(outcome)),
                Some(Heard::Answer(_, values)) => return Ok(Ok(values.into_iter().next().unwrap_or(Variant::Empty))),
                Some(Heard::Interim) => {
                    silent_since = Instant::now();
                    // The controller is at work, so the request has arrived and need not be repeated soon.
                    repeat_at = silent_since + self.options.patience / 2;
                }
                Some(Heard::Foreign) => {}
                None => {}
            }
            let now = Instant::now();
            if now >= give_up.max(silent_since + self.options.patience) {
                return Err(self.silent(call));
            }
            if repeats && now >= repeat_at {
                let again = self.exchange.again()?;
                self.link.send(&again)?;
                repeat_at = now + self.options.repeat;
            }
        }
    }

    fn silent(&self, call: Call) -> Fault {
        let (at, patience) = (self.link.address(), self.options.patience.as_millis());
        let (cause, next) = if call == Call::ServiceStart {
            (
                "what listens there does not speak b-CAP, or the controller hangs",
                "check the address and the port (b-CAP: 5007)",
            )
        } else {
            (
                "the cable is out, the controller hangs, or the call takes longer and sends no interim replies",
                "look at the robot: what it does now is not known; then connect again",
            )
        };
        Fault::device(format!("{at}: no answer to {} within {patience} ms", call.name())).cause(cause).next(next)
    }

    /// Makes a call that must succeed. A refusal becomes a fault with the controller's code and its meaning.
    pub fn ask(&mut self, call: Call, arguments: Vec<Variant>) -> Result<Variant> {
        self.call(call, arguments)?.map_err(|outcome| self.refused(call, outcome))
    }

    fn refused(&self, call: Call, outcome: Outcome) -> Fault {
        let what = format!("{}: {} was refused with {outcome}", self.link.address(), call.name());
        let (cause, next) = outcome.words().unwrap_or((
            "the controller's own reason",
            "look the code up in the controller's error list, or read it on the pendant",
        ));
        Fault::refused(what).cause(cause).next(next)
    }

    fn handle(&mut self, call: Call, arguments: Vec<Variant>) -> Result<Handle> {
        match self.ask(call, arguments)? {
            Variant::I32(handle) => Ok(Handle(handle)),
            other => Err(self.unexpected(call, "a handle", &other)),
        }
    }

    fn unexpected(&self, call: Call, wanted: &str, got: &Variant) -> Fault {
        Fault::device(format!("{}: {} answered {got:?}, {wanted} was expected", self.link.address(), call.name()))
            .cause("another version of the controller's software")
            .next("report the answer together with the controller's version")
    }

    /// The controller behind this connection.
    pub fn controller(&mut self) -> Result<Handle> {
        let names = ["", "CaoProv.DENSO.VRC", "localhost", ""];
        self.handle(Call::ControllerConnect, names.map(|n| Variant::Text(n.into())).to_vec())
    }

    /// The controller's arm.
    pub fn robot(&mut self, controller: Handle) -> Result<Handle> {
        self.handle(Call::ControllerGetRobot, vec![controller.into(), text("Arm"), text("")])
    }

    /// Executes a command of the robot with its argument, as listed in the controller's manual.
    pub fn execute(&mut self, robot: Handle, command: &str, argument: Variant) -> Result<Variant> {
        let place = |e: Fault| e.at(command);
        self.ask(Call::RobotExecute, vec![robot.into(), text(command), argument]).map_err(place)
    }

    /// The value of a variable of the controller (`get` = [`Call::ControllerGetVariable`]) or of a robot.
    pub fn read(&mut self, get: Call, owner: Handle, name: &str) -> Result<Variant> {
        let variable = self.handle(get, vec![owner.into(), text(name), text("")]).map_err(|e| e.at(name))?;
        let value = self.call(Call::VariableGetValue, vec![variable.into()])?;
        self.ask(Call::VariableRelease, vec![variable.into()])?;
        value.map_err(|outcome| self.refused(Call::VariableGetValue, outcome).at(name))
    }

    /// Writes a variable.
    pub fn write(&mut self, get: Call, owner: Handle, name: &str, value: Variant) -> Result<()> {
        let variable = self.handle(get, vec![owner.into(), text(name), text("")]).map_err(|e| e.at(name))?;
        let done = self.call(Call::VariablePutValue, vec![variable.into(), value])?;
        self.ask(Call::VariableRelease, vec![variable.into()])?;
        done.map(|_| ()).map_err(|outcome| self.refused(Call::VariablePutValue, outcome).at(name))
    }

    /// Releases robot and controller and ends the service.
    pub fn close(mut self, controller: Handle, robot: Option<Handle>) -> Result<()> {
        if let Some(robot) = robot {
            self.ask(Call::RobotRelease, vec![robot.into()])?;
        }
        self.ask(Call::ControllerDisconnect, vec![controller.into()])?;
        self.ask(Call::ServiceStop, vec![])?;
        Ok(())
    }
}

fn text(s: &str) -> Variant {
    Variant::Text(s.into())
}

impl From<Handle> for Variant {
    /// Encoded as I4: for any other type Denso's library answers and leaves the handle 0.
    fn from(handle: Handle) -> Variant {
        Variant::I32(handle.0)
    }
}
