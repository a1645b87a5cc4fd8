//! The names by which a browser may call this server. The headers Host and Origin are parsed as a name or an
//! address, with or without a port, and compared in that form.

use axum::http::uri;
use sheetlight::fault::{Fault, Result};
use std::net::{IpAddr, SocketAddr};

/// A host as written in a URL.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Name {
    /// Lower case, without a trailing dot.
    Word(String),
    Address(IpAddr),
}

/// A host with an optional port; without one, the default port of the scheme applies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Host {
    name: Name,
    port: Option<u16>,
}

impl Host {
    /// Reads `name`, `name:8620`, `10.0.0.2:8620`, `[fd00::2]:8620`; `None` for anything else.
    fn read(text: &str) -> Option<Host> {
        let authority: uri::Authority = text.parse().ok()?;
        let host = authority.host();
        let port = match authority.as_str().strip_prefix(host)? {
            "" => None,
            // A port with too many digits, or a name before an @, is not a host.
            rest => Some(rest.strip_prefix(':')?.parse().ok()?),
        };
        let inside = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
        let name = match (inside, host.parse::<IpAddr>()) {
            (Some(v6), _) => Name::Address(IpAddr::V6(v6.parse().ok()?)),
            (None, Ok(address)) => Name::Address(address),
            (None, Err(_)) => Name::Word(host.strip_suffix('.').unwrap_or(host).to_ascii_lowercase()),
        };
        (name != Name::Word(String::new())).then_some(Host { name, port })
    }
}

/// The names of a server.
#[derive(Clone, Debug)]
pub struct Hosts {
    /// True: https, because certificates were given.
    pub secure: bool,
    /// Names given by the operator.
    named: Vec<Host>,
}

impl Hosts {
    /// Names from the command line: a name or an address, with a port if a proxy uses another one.
    ///
    /// # Errors
    /// One of them is not a host.
    pub fn new(secure: bool, names: &[String]) -> Result<Hosts> {
        let read = |name: &String| {
            // An IPv6 address may be written without brackets here.
            let bare = name.parse().ok().map(|address| Host { name: Name::Address(address), port: None });
            bare.or_else(|| Host::read(name)).ok_or_else(|| {
                Fault::usage(format!("{name:?} is no host's name"))
                    .next("give a name or an address, with a port where browsers use another one: --name cell3.plant")
            })
        };
        Ok(Hosts { secure, named: names.iter().map(read).collect::<Result<_>>()? })
    }

    /// http or https.
    pub fn scheme(&self) -> &'static str {
        if self.secure { "https" } else { "http" }
    }

    /// Whether the header Host of a request received at `local` names this server. An address cannot be another
    /// site's name, but it must be the one that the client connected to.
    pub fn are(&self, host: &str, local: SocketAddr) -> bool {
        Host::read(host).is_some_and(|host| self.is_ours(&host, local))
    }

    /// Whether the header Origin names a page of this server.
    pub fn origin(&self, origin: &str, local: SocketAddr) -> bool {
        let host = origin.split_once("://").filter(|(scheme, _)| *scheme == self.scheme()).map(|(_, host)| host);
        host.is_some_and(|host| self.are(host, local))
    }

    fn is_ours(&self, host: &Host, local: SocketAddr) -> bool {
        let default = if self.secure { 443 } else { 80 };
        let (port, here) = (host.port.unwrap_or(default), local.ip().to_canonical());
        let called = match &host.name {
            Name::Address(address) => {
                let address = address.to_canonical();
                address == here || address.is_loopback() && here.is_loopback()
            }
            Name::Word(word) => word == "localhost" && here.is_loopback(),
        };
        // A name without a port matches this port, and the scheme's default port, from which a router may forward
        // to this one.
        let named =
            |n: &Host| n.name == host.name && n.port.map_or(port == default || port == local.port(), |p| p == port);
        called && port == local.port() || self.named.iter().any(named)
    }

    /// The URL to open in a browser on this machine, or on another machine if a name was given.
    pub fn url(&self, local: SocketAddr) -> String {
        let name = match (local.ip(), self.named.first()) {
            (ip, _) if !ip.is_unspecified() => return format!("{}://{local}", self.scheme()),
            (_, None) => "localhost".to_owned(),
            (_, Some(Host { name: Name::Word(word), .. })) => word.clone(),
            (_, Some(Host { name: Name::Address(IpAddr::V6(address)), .. })) => format!("[{address}]"),
            (_, Some(Host { name: Name::Address(address), .. })) => address.to_string(),
        };
        let port = self.named.first().and_then(|host| host.port).unwrap_or(local.port());
        format!("{}://{name}:{port}", self.scheme())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    #[test]
    fn hosts_are_read_as_names_and_ports() {
        let word = |w: &str, port| Some(Host { name: Name::Word(w.into()), port });
        assert_eq!(Host::read("Cell3.Plant.:8620"), word("cell3.plant", Some(8620)));
        assert_eq!(Host::read("cell3.plant"), word("cell3.plant", None));
        let v6 = Name::Address("fd00::2".parse().unwrap());
        assert_eq!(Host::read("[FD00:0::2]:443"), Some(Host { name: v6, port: Some(443) }));
        for bad in ["", " ", ":80", "a:99999", "a:", "a:x", "[fd00::2", "[x]", "me@a", "a/b", "a b", "fd00::2", "."] {
            assert_eq!(Host::read(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn a_default_port_needs_no_port_and_another_one_does() {
        let plain = Hosts::new(false, &[]).unwrap();
        assert!(plain.are("127.0.0.1", at("127.0.0.1:80")) && plain.are("127.0.0.1:80", at("127.0.0.1:80")));
        assert!(!plain.are("127.0.0.1", at("127.0.0.1:8620")) && !plain.are("127.0.0.1", at("127.0.0.1:443")));
        let tls = Hosts::new(true, &[]).unwrap();
        assert!(tls.are("10.0.0.2", at("10.0.0.2:443")) && !tls.are("10.0.0.2", at("10.0.0.2:80")));
        assert!(
            tls.origin("https://10.0.0.2", at("10.0.0.2:443")) && !tls.origin("http://10.0.0.2", at("10.0.0.2:443"))
        );
        assert!(!tls.origin("null", at("10.0.0.2:443")) && !tls.origin("https://evil.example", at("10.0.0.2:443")));
    }

    /// A server that listens on all addresses accepts only the address that the connection was made to.
    #[test]
    fn an_address_has_to_be_the_one_that_was_connected_to() {
        let all = Hosts::new(true, &[]).unwrap();
        assert!(all.are("10.0.0.2:8620", at("10.0.0.2:8620")) && !all.are("10.0.0.3:8620", at("10.0.0.2:8620")));
        assert!(!all.are("10.0.0.2:8621", at("10.0.0.2:8620")) && !all.are("0.0.0.0:8620", at("10.0.0.2:8620")));
        // [::] also accepts IPv4 connections, under mapped addresses.
        assert!(all.are("10.0.0.2:8620", at("[::ffff:10.0.0.2]:8620")));
        assert!(all.are("[fd00::2]:8620", at("[fd00::2]:8620")) && all.are("[FD00:0:0::2]:8620", at("[fd00::2]:8620")));
        assert!(all.are("localhost:8620", at("[::1]:8620")) && !all.are("localhost:8620", at("10.0.0.2:8620")));
        assert!(all.are("[::1]:8620", at("127.0.0.1:8620")), "a tunnel from the other loopback");
        assert!(!all.are("evil.example:8620", at("10.0.0.2:8620")));
    }

    #[test]
    fn names_that_were_given_are_good_with_their_ports() {
        let names = ["Cell3.plant".to_owned(), "proxy.plant:8443".to_owned(), "fd00::9".to_owned()];
        let named = Hosts::new(true, &names).unwrap();
        let local = at("10.0.0.2:8620");
        for good in ["cell3.plant", "CELL3.plant:8620", "cell3.plant:443", "proxy.plant:8443", "[fd00::9]:8620"] {
            assert!(named.are(good, local), "{good}");
        }
        for bad in ["cell3.plant:8443", "proxy.plant", "proxy.plant:8620", "cell3.plant.evil.example", "cell4.plant"] {
            assert!(!named.are(bad, local), "{bad}");
        }
        assert_eq!(named.url(at("0.0.0.0:8620")), "https://cell3.plant:8620");
        assert_eq!(Hosts::new(false, &[]).unwrap().url(at("[::]:8620")), "http://localhost:8620");
        assert_eq!(named.url(at("[fd00::2]:8620")), "https://[fd00::2]:8620");
        assert!(Hosts::new(true, &["no host".to_owned()]).is_err());
    }
}
