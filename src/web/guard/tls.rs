//! In: a listening socket, perhaps a certificate and its key. Out: connections, encrypted where those were given,
//! never more than a bounded number at a time.
//! Frame and unit: connections, seconds.

use crate::fault::{Fault, Result};
use axum::serve::Listener;
use futures_util::task::AtomicWaker;
use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::time::{Instant, Sleep};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;

/// Connections at a time; a browser has a handful. When all places are taken, the connection that has been silent for
/// longest since it was opened makes room: a client that opens connections and says nothing locks nobody out.
const MOST: usize = 256;
/// A connection on which nothing was ever read is closed after this time. Browsers open some in advance and never use
/// them.
const SILENT: Duration = Duration::from_secs(10);
/// A connection on which nothing moves either way is closed after this time; the screen's own socket is told
/// something every second.
const IDLE: Duration = Duration::from_secs(300);
/// A place becomes free within this time after a silent connection was told to go.
const ROOM: Duration = Duration::from_secs(1);
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
        let (room, silent) = (Arc::new(Semaphore::new(MOST)), Silent::default());
        tokio::spawn(async move {
            loop {
                let (stream, peer) = match listener.accept().await {
                    Ok(pair) => pair,
                    Err(_) => {
                        // Out of file handles: others have to go first.
                        tokio::time::sleep(Duration::from_millis(100)).await;
                        continue;
                    }
                };
                let permit = match room.clone().try_acquire_owned() {
                    Ok(permit) => permit,
                    Err(_) => {
                        silent.oldest_goes();
                        match tokio::time::timeout(ROOM, room.clone().acquire_owned()).await {
                            Ok(Ok(permit)) => permit,
                            // All others are at work: this one comes again.
                            _ => continue,
                        }
                    }
                };
                let _ = stream.set_nodelay(true);
                let unheard = silent.one();
                let (give, tls) = (give.clone(), tls.clone());
                tokio::spawn(async move {
                    let io = match tls {
                        None => Stream::Plain(stream),
                        Some(tls) => match tokio::time::timeout(HANDSHAKE, tls.accept(stream)).await {
                            Ok(Ok(stream)) => Stream::Tls(Box::new(stream)),
                            _ => return,
                        },
                    };
                    let idle = Box::pin(tokio::time::sleep(SILENT));
                    let _ = give.send(Connection { io, peer, unheard: Some(unheard), idle, _permit: permit }).await;
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

/// A connection on which nothing was read yet.
#[derive(Default)]
struct Unheard {
    goes: AtomicBool,
    task: AtomicWaker,
}

/// All of these, the oldest first.
#[derive(Clone, Default)]
struct Silent(Arc<Mutex<VecDeque<Weak<Unheard>>>>);

impl Silent {
    fn one(&self) -> Arc<Unheard> {
        let one = Arc::new(Unheard::default());
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|c| c.strong_count() > 0);
        all.push_back(Arc::downgrade(&one));
        one
    }

    fn oldest_goes(&self) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(oldest) = all.pop_front() {
            if let Some(oldest) = oldest.upgrade() {
                oldest.goes.store(true, Ordering::SeqCst);
                return oldest.task.wake();
            }
        }
    }
}

/// One connection; it counts until it is dropped.
pub struct Connection {
    io: Stream,
    peer: SocketAddr,
    /// `None` as soon as something was read.
    unheard: Option<Arc<Unheard>>,
    /// Ends the connection where nothing moves.
    idle: Pin<Box<Sleep>>,
    _permit: OwnedSemaphorePermit,
}

impl Connection {
    /// Something moved: the clock of an idle connection begins again.
    fn moved(&mut self) {
        self.idle.as_mut().reset(Instant::now() + IDLE);
    }
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context, buf: &mut ReadBuf) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        let read = match &mut self.io {
            Stream::Plain(s) => Pin::new(s).poll_read(cx, buf),
            Stream::Tls(s) => Pin::new(s).poll_read(cx, buf),
        };
        if read.is_ready() {
            if buf.filled().len() > before {
                self.unheard = None;
                self.moved();
            }
            return read;
        }
        if let Some(unheard) = &self.unheard {
            unheard.task.register(cx.waker());
            if unheard.goes.load(Ordering::SeqCst) {
                return Poll::Ready(Err(io::ErrorKind::ConnectionAborted.into()));
            }
        }
        self.idle.as_mut().poll(cx).map(|()| Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context, buf: &[u8]) -> Poll<io::Result<usize>> {
        self.moved();
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

#[cfg(test)]
mod tests {
    use super::*;
    use axum::Router;
    use axum::routing::get;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    async fn asks(to: SocketAddr) -> io::Result<String> {
        let mut stream = TcpStream::connect(to).await?;
        stream.write_all(b"GET / HTTP/1.1\r\nhost: here\r\nconnection: close\r\n\r\n").await?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await?;
        Ok(answer)
    }

    /// More connections than there are places, all silent: who speaks is answered, and a silent one ends by itself.
    #[test]
    fn silent_connections_lock_nobody_out() {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let to = listener.local_addr().unwrap();
            let doorway = Doorway::new(listener, None).unwrap();
            let app = Router::new().route("/", get(async || "here"));
            tokio::spawn(axum::serve(doorway, app).into_future());
            let mut idle = Vec::new();
            for _ in 0..MOST + 44 {
                idle.push(TcpStream::connect(to).await.unwrap());
            }
            let answer = tokio::time::timeout(Duration::from_secs(5), asks(to)).await.expect("within 5 s").unwrap();
            assert!(answer.ends_with("here"), "{answer}");
            let mut byte = [0];
            let ended = tokio::time::timeout(SILENT * 2, idle.last_mut().unwrap().read(&mut byte)).await;
            assert_eq!(ended.expect("it is closed").unwrap_or(0), 0);
        });
    }
}
