//! Connections: only so many at a time, and none that waits without end. Any user of this machine can open one.

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

/// At a time; a browser opens six. More of them wait in the system's queue.
const MOST_CONNECTIONS: usize = 64;
/// Within this time a request has to be there.
pub(super) const REQUEST_TIME: Duration = Duration::from_secs(10);
/// Where the system gives no connection, it is asked again after this time.
const PAUSE: Duration = Duration::from_millis(100);
/// Of a request's head, with room for what browsers and their extensions add.
const MOST_HEAD_BYTES: usize = 64 << 10;

/// Serves whoever connects, for ever.
pub(super) async fn serve(listener: TcpListener, app: Router) {
    let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    // It is never closed.
    while let Ok(place) = places.clone().acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                let app = app.clone();
                tokio::spawn(async move {
                    let _place = place;
                    answer(stream, app).await;
                });
            }
            // Too many open files, or a client that has left already: neither is a reason to end.
            Err(_) => tokio::time::sleep(PAUSE).await,
        }
    }
}

/// One request and its answer: a connection that stays open for more would keep its place from others.
async fn answer(stream: TcpStream, app: Router) {
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST_TIME)
        .keep_alive(false)
        .max_buf_size(MOST_HEAD_BYTES)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app));
    // What goes wrong is the client's: it left, took too long, or does not speak HTTP.
    let _ = connection.await;
}
