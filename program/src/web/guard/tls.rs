//! Connections from a listening socket, encrypted if a certificate was given, never more than there are slots.

use super::places::{Place, Places, Seat, machine};
use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use sheetlight::fault::{Fault, Result};
use std::future::poll_fn;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::time::{Instant, Sleep};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;

/// A connection without a session is closed after this time without traffic. Browsers open some in advance and
/// never use them.
const SILENT: Duration = Duration::from_secs(10);
/// The same for a connection with a session; the screen's WebSocket gets a message every second.
const IDLE: Duration = Duration::from_secs(300);
/// A client that does not finish its handshake within this time is disconnected.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// Reads a certificate chain and its key (PEM).
pub fn tls(certificates: &Path, key: &Path) -> Result<TlsAcceptor> {
    let bad = |path: &Path, e: &dyn std::fmt::Display| {
        Fault::input(format!("{}: cannot be used for TLS: {e}", path.display()))
            .cause("not PEM, damaged, or key and certificate do not belong together")
            .next("give the certificate's chain and its private key as PEM files")
    };
    let chain = CertificateDer::pem_file_iter(certificates)
        .and_then(|all| all.collect::<std::result::Result<Vec<_>, _>>())
        .map_err(|e| bad(certificates, &e))?;
    let secret = PrivateKeyDer::from_pem_file(key).map_err(|e| bad(key, &e))?;
    let config = ServerConfig::builder().with_no_client_auth().with_single_cert(chain, secret);
    Ok(TlsAcceptor::from(Arc::new(config.map_err(|e| bad(certificates, &e))?)))
}

/// The listener that accepts connections.
pub struct Doorway {
    address: SocketAddr,
    ready: mpsc::Receiver<Connection>,
}

impl Doorway {
    /// Accepts in the background, so that a slow handshake delays no other connection.
    pub fn new(listener: TcpListener, tls: Option<TlsAcceptor>) -> io::Result<Doorway> {
        let address = listener.local_addr()?;
        let (give, ready) = mpsc::channel(16);
        tokio::spawn(accept(listener, tls, give));
        Ok(Doorway { address, ready })
    }
}

async fn accept(listener: TcpListener, tls: Option<TlsAcceptor>, give: mpsc::Sender<Connection>) {
    let places = Arc::new(Places::default());
    loop {
        let Ok((stream, from)) = listener.accept().await else {
            // Out of file handles: other connections must close first.
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        let Ok(local) = stream.local_addr() else { continue };
        let _ = stream.set_nodelay(true);
        let seat = places.take(from.ip());
        let (give, tls) = (give.clone(), tls.clone());
        tokio::spawn(async move {
            let io = match tls {
                None => Stream::Plain(stream),
                Some(tls) => Stream::Tls(Box::new(shaken(tls.accept(stream), &seat.place).await?)),
            };
            let peer = Peer { from, local, seat: Arc::new(seat) };
            let idle = Box::pin(tokio::time::sleep(SILENT));
            give.send(Connection { io, peer, moved: Instant::now(), idle }).await.ok()
        });
    }
}

/// A finished handshake; `None` if it fails, takes too long, or its slot is given to another connection.
async fn shaken<T>(handshake: impl Future<Output = io::Result<T>>, place: &Place) -> Option<T> {
    let gone = poll_fn(|cx| if place.is_gone(cx) { Poll::Ready(()) } else { Poll::Pending });
    tokio::select! {
        done = tokio::time::timeout(HANDSHAKE, handshake) => done.ok()?.ok(),
        () = gone => None,
    }
}

impl Listener for Doorway {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        match self.ready.recv().await {
            Some(connection) => {
                let from = connection.peer.from;
                (connection, from)
            }
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.address)
    }
}

/// The other end of a connection, as requests see it.
#[derive(Clone, Debug)]
pub struct Peer {
    from: SocketAddr,
    /// The local address of the connection.
    pub local: SocketAddr,
    seat: Arc<Seat>,
}

impl Peer {
    /// The machine at the other end.
    pub fn machine(&self) -> IpAddr {
        machine(self.from.ip())
    }

    /// A request of this connection showed a session.
    pub fn shows_session(&self) {
        self.seat.places.shows_session(&self.seat.place);
    }
}

impl Connected<IncomingStream<'_, Doorway>> for Peer {
    fn connect_info(stream: IncomingStream<'_, Doorway>) -> Peer {
        stream.io().peer.clone()
    }
}

enum Stream {
    Plain(TcpStream),
    Tls(Box<TlsStream<TcpStream>>),
}

/// One connection; its slot is freed when the connection and its requests have ended.
pub struct Connection {
    io: Stream,
    peer: Peer,
    moved: Instant,
    /// Wakes the task when the connection may have been idle for too long.
    idle: Pin<Box<Sleep>>,
}

impl Connection {
    /// Why the connection ends although its peer has not closed it: its slot was needed, or it was idle for too
    /// long.
    fn over(&mut self, cx: &mut Context) -> Poll<io::Error> {
        let place = &self.peer.seat.place;
        if place.is_gone(cx) {
            return Poll::Ready(io::ErrorKind::ConnectionAborted.into());
        }
        let until = self.moved + if place.is_guest() { IDLE } else { SILENT };
        loop {
            std::task::ready!(self.idle.as_mut().poll(cx));
            if until <= Instant::now() {
                return Poll::Ready(io::ErrorKind::TimedOut.into());
            }
            self.idle.as_mut().reset(until);
        }
    }
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context, buf: &mut ReadBuf) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        let read = match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_read(cx, buf),
            Stream::Tls(s) => Pin::new(s).poll_read(cx, buf),
        };
        if read.is_pending() {
            return self.over(cx).map(Err);
        }
        if buf.filled().len() > before {
            self.moved = Instant::now();
        }
        read
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context, buf: &[u8]) -> Poll<io::Result<usize>> {
        let written = match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_write(cx, buf),
            Stream::Tls(s) => Pin::new(s).poll_write(cx, buf),
        };
        if written.is_pending() {
            return self.over(cx).map(Err);
        }
        self.moved = Instant::now();
        written
    }
    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context) -> Poll<io::Result<()>> {
        match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_flush(cx),
            Stream::Tls(s) => Pin::new(s).poll_flush(cx),
        }
    }
    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context) -> Poll<io::Result<()>> {
        match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_shutdown(cx),
            Stream::Tls(s) => Pin::new(s).poll_shutdown(cx),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::Router;
    use axum::extract::ConnectInfo;
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    async fn asks(to: SocketAddr) -> io::Result<String> {
        let mut stream = TcpStream::connect(to).await?;
        stream.write_all(b"GET / HTTP/1.1\r\nhost: here\r\nconnection: close\r\n\r\n").await?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await?;
        Ok(answer)
    }

    /// A server that treats every request to `/me` as one with a session.
    fn served(what: impl AsyncFnOnce(SocketAddr)) {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let to = listener.local_addr().unwrap();
            let doorway = Doorway::new(listener, None).unwrap();
            let shows = async |ConnectInfo(peer): ConnectInfo<Peer>| {
                peer.shows_session();
                "here"
            };
            let app = Router::new().route("/", get(async || "here")).route("/me", get(shows));
            let app = app.into_make_service_with_connect_info::<Peer>();
            tokio::spawn(axum::serve(doorway, app).into_future());
            what(to).await;
        });
    }

    /// Another request on a connection that stays open.
    async fn again(stream: &mut TcpStream, path: &str) -> io::Result<bool> {
        stream.write_all(format!("GET {path} HTTP/1.1\r\nhost: here\r\n\r\n").as_bytes()).await?;
        let mut answer = [0; 1024];
        let read = stream.read(&mut answer).await?;
        Ok(answer[..read].ends_with(b"here"))
    }

    /// More connections than slots, some silent, some with a request that they never end. A client that sends a
    /// request is answered, a connection with a session stays, and a silent one is closed in time.
    #[test]
    fn idle_connections_lock_nobody_out() {
        served(async |to| {
            let mut mine = TcpStream::connect(to).await.unwrap();
            assert!(again(&mut mine, "/me").await.unwrap());
            let mut idle = Vec::new();
            for k in 0..600 {
                let mut stream = TcpStream::connect(to).await.unwrap();
                if k % 2 == 1 {
                    // The write fails if the connection's slot was given away meanwhile.
                    let _ = stream.write_all(b"GET /me HTTP/1.1\r\nhost").await;
                }
                idle.push(stream);
            }
            let answer = tokio::time::timeout(Duration::from_secs(20), asks(to)).await.expect("in time").unwrap();
            assert!(answer.ends_with("here"), "{answer}");
            assert!(again(&mut mine, "/me").await.unwrap(), "a session's connection made room for them");
            for last in idle.iter_mut().rev().take(2) {
                let ended = tokio::time::timeout(SILENT * 3, last.read(&mut [0])).await;
                assert_eq!(ended.expect("it is closed").unwrap_or(0), 0);
            }
            assert!(again(&mut mine, "/me").await.unwrap(), "it was idle for less than its own time");
        });
    }
}
