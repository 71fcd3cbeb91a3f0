//! The server: one page, its choices, refits, and keeping a pipeline.

use super::connections::{self, REQUEST_TIME};
use super::guard::Guard;
use super::live::Live;
use super::requests::{MOST_EFFECTS, Wanted};
use super::session::RefitSession;
use super::turns::{MOST_ASKED, Turns};
use crate::error::Error;
use armcal_calibrate::Stop;
use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde_json::json;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use tokio::task::JoinError;

/// A question is a few names and a formula [bytes].
const LARGEST_BODY: usize = 64 * 1024;

/// Serves a bench on 127.0.0.1 until the process ends; calls `ready` with the address when it listens. Port 0 takes any
/// free one.
pub fn serve(live: Live, port: u16, ready: impl FnOnce(&str) -> Result<(), Error>) -> Result<(), Error> {
    let failed = |what: &'static str| move |source| Error::Serve { what, port, source };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed("listening"))?;
    let port = listener.local_addr().map_err(failed("listening"))?.port();
    listener.set_nonblocking(true).map_err(failed("listening"))?;
    let guard = Guard::new(port).map_err(|e| failed("drawing a secret")(std::io::Error::other(e)))?;
    let address = format!("http://127.0.0.1:{port}/{}/", guard.secret);
    let app = build_router(Arc::new(Served { live, turns: Turns::new() }), guard);
    let mut runtime = tokio::runtime::Builder::new_current_thread();
    // A thread each for the one that is computed and those that are written.
    let runtime =
        runtime.enable_all().max_blocking_threads(MOST_ASKED).build().map_err(failed("starting"))?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener).map_err(failed("listening"))?;
        ready(&address)?;
        connections::serve(listener, app).await;
        Ok(())
    })
}

struct Served {
    live: Live,
    turns: Turns,
}

fn build_router(served: Arc<Served>, guard: Guard) -> Router {
    let own = Router::new()
        .route("/", get(page))
        .route("/choices", get(choices))
        .route("/refit", post(refit))
        .route("/keep", post(keep))
        .with_state(served);
    Router::new()
        .nest_service(&format!("/{}", guard.secret), own)
        .layer(from_fn(arrived))
        .layer(from_fn_with_state(guard, guarded))
}

async fn guarded(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    let mut response = match guard.refuses(request.method(), request.headers()) {
        Some(why) => json_response(StatusCode::FORBIDDEN, &json!({ "error": why })),
        None => next.run(request).await,
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        // The page itself says what it may run and whom it may ask.
        (header::CONTENT_SECURITY_POLICY, "frame-ancestors 'none'"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Hands on what has arrived in time and is not too large.
async fn arrived(request: Request, next: Next) -> Response {
    let (head, body) = request.into_parts();
    match tokio::time::timeout(REQUEST_TIME, to_bytes(body, LARGEST_BODY)).await {
        Ok(Ok(bytes)) => next.run(Request::from_parts(head, Body::from(bytes))).await,
        Ok(Err(e)) => json_response(
            StatusCode::PAYLOAD_TOO_LARGE,
            &json!({ "error": format!("reading the request: {e}") }),
        ),
        Err(_) => json_response(
            StatusCode::REQUEST_TIMEOUT,
            &json!({ "error": "the request took too long to arrive" }),
        ),
    }
}

async fn page(State(served): State<Arc<Served>>) -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], served.live.html().to_owned()).into_response()
}

async fn choices(State(served): State<Arc<Served>>) -> Response {
    let choices =
        move || served.live.session().map(|s| json!(s.choices()).to_string()).map_err(Error::to_string);
    answered(tokio::task::spawn_blocking(choices).await)
}

/// Stops a refit when nobody waits for it any more: its request is dropped with the connection.
struct Waiting(Stop);

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.now();
    }
}

async fn refit(State(served): State<Arc<Served>>, body: Bytes) -> Response {
    let Some(place) = served.turns.place() else { return too_many() };
    let waiting = Waiting(Stop::default());
    let stop = waiting.0.clone();
    let turn = served.turns.turn().await;
    asked(served, body, move |session, wanted| {
        let _held = (place, turn);
        session.refit(wanted, &stop)
    })
    .await
}

async fn keep(State(served): State<Arc<Served>>, body: Bytes) -> Response {
    let Some(place) = served.turns.place() else { return too_many() };
    asked(served, body, move |session, wanted| {
        let _held = place;
        let path = session.keep(wanted)?;
        Ok(json!({ "pipeline": path.to_string_lossy() }).to_string())
    })
    .await
}

fn too_many() -> Response {
    let why = format!("{MOST_ASKED} refits are under way already; ask again when they are done");
    json_response(StatusCode::SERVICE_UNAVAILABLE, &json!({ "error": why }))
}

/// Does the arithmetic beside the server's own thread; what cannot be done is told in words.
async fn asked(
    served: Arc<Served>,
    body: Bytes,
    what: impl FnOnce(&RefitSession, &Wanted) -> Result<String, Error> + Send + 'static,
) -> Response {
    let wanted: Wanted = match serde_json::from_slice(&body) {
        Ok(wanted) => wanted,
        Err(e) => {
            return json_response(
                StatusCode::BAD_REQUEST,
                &json!({ "error": format!("reading the request: {e}") }),
            );
        }
    };
    if wanted.count() > MOST_EFFECTS {
        let why = format!("{} effects are wanted at once, and {MOST_EFFECTS} at most can be", wanted.count());
        return json_response(StatusCode::BAD_REQUEST, &json!({ "error": why }));
    }
    let done = move || {
        let session = served.live.session().map_err(Error::to_string)?;
        what(session, &wanted).map_err(|e| e.to_string())
    };
    answered(tokio::task::spawn_blocking(done).await)
}

fn answered(done: Result<Result<String, String>, JoinError>) -> Response {
    match done {
        Ok(Ok(text)) => ([(header::CONTENT_TYPE, "application/json")], text).into_response(),
        Ok(Err(why)) => json_response(StatusCode::UNPROCESSABLE_ENTITY, &json!({ "error": why })),
        Err(e) => json_response(StatusCode::INTERNAL_SERVER_ERROR, &json!({ "error": e.to_string() })),
    }
}

fn json_response(status: StatusCode, value: &serde_json::Value) -> Response {
    (status, [(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response()
}
