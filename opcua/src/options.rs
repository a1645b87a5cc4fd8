//! In: the command line. Out: what it asks for, checked. Pure but for the address that a name has.
//! Frame and unit: none.

use clap::Parser;
use sheetlight_registers::{is_address, is_name};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;

/// Show a station to OPC UA clients as a vision system
///
/// The nodes are those of the Machine Vision companion specification (OPC 40100-1).
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    long_about = None,
    max_term_width = 98,
    after_help = "\
Examples:
  sheetlight station serve --station cell3 --robot bcap://192.168.0.5 --modbus 5020
  sheetlight-opcua --station 127.0.0.1:5020 --recipe led --recipe osc
  sheetlight-opcua --station 127.0.0.1:5020 --listen opc.tcp://192.168.0.10:4840 \\
      --pki opcua-pki --login opcua-login

A client starts jobs. It confirms no motion: a person does that at the station's screen.
Guide: docs/connections.md"
)]
pub struct Options {
    /// The station: HOST:PORT of `station serve --modbus` or of `robot serve --protocol modbus`
    #[arg(long, value_name = "HOST:PORT", value_parser = station)]
    pub station: String,
    /// Address to listen on; another one than this machine's own needs --pki and --login
    #[arg(long, value_name = "URL", default_value = "opc.tcp://127.0.0.1:4840", value_parser = listen)]
    pub listen: Listen,
    /// A recipe of the station that clients may prepare; may be repeated [default: any name, and the station decides]
    #[arg(long, value_name = "NAME", value_parser = recipe)]
    pub recipe: Vec<String>,
    /// Folder of certificates: own/, private/, trusted/, rejected/; made with a new certificate if it is missing
    #[arg(long, value_name = "DIR")]
    pub pki: Option<PathBuf>,
    /// File with the clients' name on its first line and their password on its second; needs --pki
    #[arg(long, value_name = "FILE", requires = "pki")]
    pub login: Option<PathBuf>,
}

/// Where clients connect.
#[derive(Clone, Debug, PartialEq)]
pub struct Listen {
    /// The host as it was written: clients get it back in the endpoints.
    pub host: String,
    pub address: SocketAddr,
}

fn station(text: &str) -> Result<String, String> {
    match is_address(text) {
        true => Ok(text.to_owned()),
        false => Err("wanted HOST:PORT, e.g. 127.0.0.1:5020".into()),
    }
}

fn listen(text: &str) -> Result<Listen, String> {
    let wanted = || "wanted opc.tcp://HOST:PORT, e.g. opc.tcp://127.0.0.1:4840".to_owned();
    let rest = text.strip_prefix("opc.tcp://").ok_or_else(wanted)?;
    let rest = rest.strip_suffix('/').unwrap_or(rest);
    let (host, port) = rest.rsplit_once(':').ok_or_else(wanted)?;
    let port: u16 = port.parse().map_err(|_| wanted())?;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    if bare.is_empty() || bare.contains('/') {
        return Err(wanted());
    }
    let found = (bare, port).to_socket_addrs().map_err(|e| format!("the host {bare} has no address: {e}"))?.next();
    let address = found.ok_or_else(|| format!("the host {bare} has no address"))?;
    Ok(Listen { host: host.to_owned(), address })
}

fn recipe(text: &str) -> Result<String, String> {
    match is_name(text) {
        true => Ok(text.to_owned()),
        false => Err("wanted the name of a recipe: 1 to 40 letters, digits, - and _".into()),
    }
}

impl Options {
    /// Whether only this machine reaches the door.
    ///
    /// # Errors
    /// Other machines reach it, and nothing keeps strangers out.
    pub fn is_loopback(&self) -> Result<bool, String> {
        let loopback = self.listen.address.ip().is_loopback();
        if loopback || self.pki.is_some() && self.login.is_some() {
            return Ok(loopback);
        }
        Err(format!(
            "--listen {}: other machines reach this address, and --pki or --login is missing",
            self.listen.address
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<Options, String> {
        let all = ["sheetlight-opcua"].iter().chain(words);
        Options::try_parse_from(all).map_err(|e| e.to_string())
    }

    #[test]
    fn addresses_and_names_are_checked() {
        let good = parsed(&["--station", "cell3:502", "--recipe", "led", "--recipe", "osc"]).unwrap();
        assert_eq!((good.listen.address.to_string(), good.recipe.len()), ("127.0.0.1:4840".to_owned(), 2));
        for bad in [
            &["--station", "cell3"][..],
            &["--station", "cell3:0"],
            &["--station", "a:1", "--listen", "127.0.0.1:4840"],
            &["--station", "a:1", "--listen", "opc.tcp://127.0.0.1"],
            &["--station", "a:1", "--listen", "opc.tcp://127.0.0.1:99999"],
            &["--station", "a:1", "--recipe", "../led"],
            &["--station", "a:1", "--login", "x"],
            &[],
        ] {
            assert!(parsed(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn other_machines_need_certificates_and_a_login() {
        let of = |more: &[&str]| {
            let all: Vec<&str> = ["--station", "a:1"].iter().chain(more).copied().collect();
            parsed(&all).unwrap().is_loopback()
        };
        assert_eq!(of(&["--listen", "opc.tcp://[::1]:4840/"]), Ok(true));
        assert!(of(&["--listen", "opc.tcp://0.0.0.0:4840"]).is_err());
        assert!(of(&["--listen", "opc.tcp://0.0.0.0:4840", "--pki", "p"]).is_err());
        assert_eq!(of(&["--listen", "opc.tcp://0.0.0.0:4840", "--pki", "p", "--login", "l"]), Ok(false));
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
        let shown: Vec<&str> = text.lines().filter(|line| line.starts_with("sheetlight-opcua ")).collect();
        assert!(shown.len() > 1, "{shown:?}");
        for command in shown {
            let options = parsed(&command.split_whitespace().skip(1).collect::<Vec<_>>());
            let loopback = options.unwrap_or_else(|e| panic!("{command}: {e}")).is_loopback();
            assert!(loopback.is_ok(), "{command}: {loopback:?}");
        }
    }
}
