//! In: the command line. Out: what it asks for, checked.
//! Frame and unit: s.

use crate::definition::is_word;
use crate::names::is_name;
use crate::station::Notation;
use clap::Parser;
use sheetlight_registers::is_address;
use std::path::PathBuf;

/// Send the messages of an MCAP file or pipe to ROS 2 over Zenoh, or show a station in ROS 2
///
/// Topics and services appear as rmw_zenoh's own do. A file's channels need profile ros2, ros2msg schemas and cdr
/// messages.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    long_about = None,
    max_term_width = 98,
    after_help = "\
Examples:
  sheetlight-ros2 board7.mcap
  sheetlight-ros2 board7.mcap --rate 0.5 --stay --domain 3
  sheetlight live --station cell3 --camera gige://first --mcap - | sheetlight-ros2 -
  sheetlight-ros2 - --connect tcp/192.168.0.20:7447 --namespace /cell3 < board7.mcap
  sheetlight-ros2 --station 127.0.0.1:5020 --recipe led --notation denso
  ros2 service call /sheetlight/insert/led std_srvs/srv/Trigger
  ros2 service call /sheetlight/scan std_srvs/srv/Trigger

Without --connect and --listen it connects to a router of this machine: tcp/127.0.0.1:7447.
Services start jobs. They confirm no motion: a person does that at the station's screen.
Guide: docs/connections.md"
)]
pub struct Options {
    /// MCAP file, played at its recorded pace; - is standard input, sent as it comes
    #[arg(value_name = "FILE|-", required_unless_present = "station")]
    pub input: Option<PathBuf>,
    /// Instead of a file: HOST:PORT of `station serve --modbus`, whose state is shown and whose jobs are services
    #[arg(long, value_name = "HOST:PORT", value_parser = station,
        conflicts_with_all = ["input", "rate", "delay", "stay"])]
    pub station: Option<String>,
    /// A recipe of the station that gets services insert and find; may be repeated
    #[arg(long, value_name = "NAME", value_parser = word, requires = "station", conflicts_with = "input")]
    pub recipe: Vec<String>,
    /// A recording of the station that gets a service scan, beside the newest one's; may be repeated
    #[arg(long, value_name = "NAME", value_parser = word, requires = "station", conflicts_with = "input")]
    pub recording: Vec<String>,
    /// Order of the angles in the station's poses; with it insertion poses are sent
    #[arg(long, value_enum, requires = "station", conflicts_with = "input")]
    pub notation: Option<Notation>,
    /// Name of the robot's base frame in these poses
    #[arg(long, value_name = "NAME", default_value = "base", value_parser = frame, requires = "station",
        conflicts_with = "input")]
    pub frame: String,
    /// The router to connect to [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "tcp/HOST:PORT", value_parser = endpoint, conflicts_with = "listen")]
    pub connect: Option<String>,
    /// Needs no router: listen for Zenoh programs that connect here [default address: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "tcp/HOST:PORT", value_parser = endpoint, num_args = 0..=1,
        default_missing_value = HERE)]
    pub listen: Option<String>,
    /// Domain of ROS 2 [default: ROS_DOMAIN_ID, or 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=232))]
    pub domain: Option<u32>,
    /// Namespace before all topics, also before /tf
    #[arg(long, value_name = "/NAME", default_value = "/", value_parser = namespace, hide_default_value = true)]
    pub namespace: String,
    /// Speed of a file's playing: 2 is twice as fast as recorded [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = rate)]
    pub rate: Option<f64>,
    /// Seconds to wait before the first message, for subscribers that connect meanwhile
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = delay, hide_default_value = true)]
    pub delay: f64,
    /// Stay after the last message, and give what is kept to later subscribers, until Ctrl-C
    #[arg(long)]
    pub stay: bool,
    /// Also find routers and subscribers by multicast in the local network
    #[arg(long)]
    pub multicast: bool,
}

/// Where a router of this machine listens.
pub const HERE: &str = "tcp/127.0.0.1:7447";
/// The domain, as programs of ROS 2 read it.
const DOMAIN: &str = "ROS_DOMAIN_ID";

fn endpoint(text: &str) -> Result<String, String> {
    let wanted = || format!("wanted tcp/HOST:PORT, e.g. {HERE}");
    let (host, port) = text.strip_prefix("tcp/").and_then(|rest| rest.rsplit_once(':')).ok_or_else(wanted)?;
    let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | ':' | '[' | ']' | '%');
    let port = port.parse::<u16>().ok().filter(|port| *port > 0);
    match port {
        Some(_) if !host.is_empty() && host.chars().all(good) => Ok(text.to_owned()),
        _ => Err(wanted()),
    }
}

fn station(text: &str) -> Result<String, String> {
    match is_address(text) {
        true => Ok(text.to_owned()),
        false => Err("wanted HOST:PORT, e.g. 127.0.0.1:5020".into()),
    }
}

/// Services are named after recipes and recordings, and names of ROS 2 have fewer letters than their names.
fn word(text: &str) -> Result<String, String> {
    match is_word(text) && text.len() <= 40 {
        true => Ok(text.to_owned()),
        false => Err("wanted 1 to 40 letters, digits and _, a letter first; store it under such a name".into()),
    }
}

fn frame(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '/');
    match (1..=100).contains(&text.len()) && text.chars().all(plain) && !text.starts_with('/') {
        true => Ok(text.to_owned()),
        false => Err("wanted the name of a frame, e.g. base_link".into()),
    }
}

fn namespace(text: &str) -> Result<String, String> {
    match text == "/" || is_name(text) {
        true => Ok(text.to_owned()),
        false => Err("wanted a name of ROS 2 that begins with /, e.g. /cell3".into()),
    }
}

fn between(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|n| (low..=high).contains(n));
    number.ok_or_else(|| format!("wanted a number from {low} to {high}"))
}

fn rate(text: &str) -> Result<f64, String> {
    between(text, 0.001, 1000.0)
}

fn delay(text: &str) -> Result<f64, String> {
    between(text, 0.0, 3600.0)
}

impl Options {
    /// Whether the messages come from standard input.
    pub fn is_live(&self) -> bool {
        self.input.as_ref().is_some_and(|input| input.as_os_str() == "-")
    }

    /// The domain.
    ///
    /// # Errors
    /// In words: none is given, and ROS_DOMAIN_ID is no domain.
    pub fn domain(&self) -> Result<u32, String> {
        let told = std::env::var(DOMAIN).ok().filter(|text| !text.is_empty());
        match (self.domain, told) {
            (Some(domain), _) => Ok(domain),
            (None, None) => Ok(0),
            (None, Some(text)) => text
                .parse::<u32>()
                .ok()
                .filter(|n| *n <= 232)
                .ok_or_else(|| format!("{DOMAIN} is '{text}', domains are 0 to 232")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<Options, String> {
        let all = ["sheetlight-ros2"].iter().chain(words);
        Options::try_parse_from(all).map_err(|e| e.to_string())
    }

    #[test]
    fn options_are_checked() {
        let good = parsed(&["-", "--listen"]).unwrap();
        assert_eq!((good.is_live(), good.listen.as_deref(), good.connect), (true, Some(HERE), None));
        assert_eq!(parsed(&["a", "--listen", "tcp/[::1]:7"]).unwrap().listen.as_deref(), Some("tcp/[::1]:7"));
        assert_eq!(parsed(&["a.mcap", "--domain", "7"]).unwrap().domain(), Ok(7));
        let of_station = parsed(&["--station", "127.0.0.1:5020", "--recipe", "led", "--notation", "kuka"]).unwrap();
        assert_eq!((of_station.recipe, of_station.notation), (vec!["led".to_owned()], Some(Notation::Kuka)));
        for bad in [
            &["a", "--station", "127.0.0.1:5020"][..],
            &["--station", "127.0.0.1"],
            &["--station", "127.0.0.1:5020", "--rate", "1"],
            &["--station", "127.0.0.1:5020", "--recipe", "led-2"],
            &["--station", "127.0.0.1:5020", "--recording", "a/b"],
            &["--station", "127.0.0.1:5020", "--frame", "/base"],
            &["--station", "127.0.0.1:5020", "--notation", "abb"],
            &["a", "--recipe", "led"],
            &["a", "--recording", "board"],
            &["a", "--notation", "kuka"],
            &["a", "--frame", "b"],
            &[],
            &["a", "--connect", "127.0.0.1:7447"],
            &["a", "--connect", "tcp/127.0.0.1"],
            &["a", "--connect", "tcp/127.0.0.1:0"],
            &["a", "--connect", "tcp/a b:1"],
            &["a", "--connect", "tcp/a#iface=x:1"],
            &["a", "--connect", "tcp/a:1", "--listen", "tcp/a:1"],
            &["a", "--domain", "233"],
            &["a", "--namespace", "cell3"],
            &["a", "--namespace", "/a b"],
            &["a", "--rate", "0"],
            &["a", "--rate", "nan"],
            &["a", "--delay", "-1"],
        ] {
            assert!(parsed(bad).is_err(), "{bad:?}");
        }
    }

    /// The rules of the program sheetlight hold here too: a help fits a screen.
    #[test]
    fn the_help_fits_a_screen() {
        use clap::CommandFactory;
        let help = Options::command().render_help().to_string();
        assert!(help.lines().count() <= 48, "{help}");
        assert!(help.lines().all(|line| line.chars().count() <= 98), "{help}");
    }

    /// Every command of this program in the document is understood.
    #[test]
    fn the_document_shows_commands_that_are_understood() {
        let text = include_str!("../../docs/connections.md").replace("\\\n", " ");
        let commands = text.lines().filter_map(|line| line.find("sheetlight-ros2 ").map(|at| (at, &line[at..])));
        // Behind the prompt, a pipe, or at the begin of a line; elsewhere it is a sentence.
        let shown: Vec<&str> = commands
            .filter(|(at, command)| *at == 0 || command.contains(" - ") || command.ends_with(" -"))
            .map(|(_, command)| command)
            .collect();
        assert!(shown.len() > 2, "{shown:?}");
        for command in shown {
            let words: Vec<&str> = command.split('<').next().unwrap_or("").split_whitespace().skip(1).collect();
            parsed(&words).unwrap_or_else(|e| panic!("{command}: {e}"));
        }
    }
}
