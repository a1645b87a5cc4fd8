//! In: a listening socket, perhaps a certificate and its key. Out: connections, encrypted where those were given, never more
//! than a bounded number at a time.
//! Frame and unit: connections, seconds.

use crate::fault::{Fault, Result};
use axum::serve::Listener;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;

/// Connections at a time; a browser has a handful.
const MOST: usize = 256;
/// A client that does not finish its handshake in so long is let go.
const HANDSHAKE: Duration = Duration::from_secs(10);

/// Reads a certificate's chain and its key (PEM).
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

/// Where connections come in.
pub struct Doorway {
    address: SocketAddr,
    ready: mpsc::Receiver<Connection>,
}

impl Doorway {
    /// Accepts in the background, so that a slow handshake keeps nobody else waiting.
    pub fn new(listener: TcpListener, tls: Option<TlsAcceptor>) -> io::Result<Doorway> {
        let address = listener.local_addr()?;
        let (give, ready) = mpsc::channel(16);
        let room = Arc::new(Semaphore::new(MOST));
        tokio::spawn(async move {
            loop {
                let Ok(permit) = room.clone().acquire_owned().await else { return };
                let (stream, peer) = match listener.accept().await {
                    Ok(pair) => pair,
                    Err(_) => {
                        // Out of file handles: others have to go first.
                        tokio::time::sleep(Duration::from_millis(100)).await;
                        continue;
                    }
                };
                let _ = stream.set_nodelay(true);
                let (give, tls) = (give.clone(), tls.clone());
                tokio::spawn(async move {
                    let io = match tls {
                        None => Stream::Plain(stream),
                        Some(tls) => match tokio::time::timeout(HANDSHAKE, tls.accept(stream)).await {
                            Ok(Ok(stream)) => Stream::Tls(Box::new(stream)),
                            _ => return,
                        },
                    };
                    let _ = give.send(Connection { io, peer, _permit: permit }).await;
                });
            }
        });
        Ok(Doorway { address, ready })
    }
}

impl Listener for Doorway {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        match self.ready.recv().await {
            Some(c) => {
                let peer = c.peer;
                (c, peer)
            }
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.address)
    }
}

enum Stream {
    Plain(TcpStream),
    Tls(Box<TlsStream<TcpStream>>),
}

/// One connection; it counts until it is dropped.
pub struct Connection {
    io: Stream,
    peer: SocketAddr,
    _permit: OwnedSemaphorePermit,
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context, buf: &mut ReadBuf) -> Poll<io::Result<()>> {
        match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_read(cx, buf),
            Stream::Tls(s) => Pin::new(s).poll_read(cx, buf),
        }
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context, buf: &[u8]) -> Poll<io::Result<usize>> {
        match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_write(cx, buf),
            Stream::Tls(s) => Pin::new(s).poll_write(cx, buf),
        }
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
