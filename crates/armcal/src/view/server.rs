//! The server: one page, its choices, refits, and keeping a pipeline.

use super::bench::Bench;
use super::guard::Guard;
use super::requests::Wanted;
use super::turns::{MOST_ASKED, Turns};
use crate::error::Error;
use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde_json::json;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;

/// A question is a few names and a formula [bytes].
const LARGEST_BODY: usize = 64 * 1024;

/// Serves a bench on 127.0.0.1 until the process ends; calls `ready` with the address when it listens. Port 0 takes any
/// free one.
pub fn serve(bench: Bench, port: u16, ready: impl FnOnce(&str) -> Result<(), Error>) -> Result<(), Error> {
    let failed = |what: &'static str| move |source| Error::Serve { what, port, source };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed("listening"))?;
    let port = listener.local_addr().map_err(failed("listening"))?.port();
    listener.set_nonblocking(true).map_err(failed("listening"))?;
    let guard = Guard::new(port).map_err(|e| failed("drawing a secret")(std::io::Error::other(e)))?;
    let address = format!("http://127.0.0.1:{port}/{}/", guard.secret);
    let html = bench.html()?;
    let app = routes(Arc::new(Served { bench, html, turns: Arc::default() }), guard);
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_io().build().map_err(failed("starting"))?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener).map_err(failed("listening"))?;
        ready(&address)?;
        axum::serve(listener, app).await.map_err(failed("serving"))
    })
}

struct Served {
    bench: Bench,
    html: String,
    turns: Arc<Turns>,
}

fn routes(served: Arc<Served>, guard: Guard) -> Router {
    let own = Router::new()
        .route("/", get(page))
        .route("/choices", get(choices))
        .route("/refit", post(refit))
        .route("/keep", post(keep))
        .with_state(served);
    Router::new()
        .nest_service(&format!("/{}", guard.secret), own)
        .layer(DefaultBodyLimit::max(LARGEST_BODY))
        .layer(from_fn_with_state(guard, guarded))
}

async fn guarded(State(guard): State<Guard>, request: Request, next: Next) -> Response {
    let mut response = match guard.refuses(request.method(), request.headers()) {
        Some(why) => answer(StatusCode::FORBIDDEN, &json!({ "error": why })),
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

async fn page(State(served): State<Arc<Served>>) -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], served.html.clone()).into_response()
}

async fn choices(State(served): State<Arc<Served>>) -> Response {
    answer(StatusCode::OK, &json!(served.bench.choices()))
}

async fn refit(State(served): State<Arc<Served>>, body: Bytes) -> Response {
    let Some(place) = served.turns.place() else {
        let why = format!("{MOST_ASKED} refits are under way already; ask again when they are done");
        return answer(StatusCode::SERVICE_UNAVAILABLE, &json!({ "error": why }));
    };
    asked(served, body, move |bench, wanted| {
        let _turn = place.turn();
        bench.refit(wanted)
    })
    .await
}

async fn keep(State(served): State<Arc<Served>>, body: Bytes) -> Response {
    asked(served, body, |bench, wanted| {
        let path = bench.keep(wanted)?;
        Ok(json!({ "pipeline": path.to_string_lossy() }).to_string())
    })
    .await
}

/// Does the arithmetic beside the server's own thread; what cannot be done is told in words.
async fn asked(
    served: Arc<Served>,
    body: Bytes,
    what: impl FnOnce(&Bench, &Wanted) -> Result<String, Error> + Send + 'static,
) -> Response {
    let wanted: Wanted = match serde_json::from_slice(&body) {
        Ok(wanted) => wanted,
        Err(e) => {
            return answer(StatusCode::BAD_REQUEST, &json!({ "error": format!("reading the request: {e}") }));
        }
    };
    let done = tokio::task::spawn_blocking(move || what(&served.bench, &wanted)).await;
    match done {
        Ok(Ok(text)) => ([(header::CONTENT_TYPE, "application/json")], text).into_response(),
        Ok(Err(e)) => answer(StatusCode::UNPROCESSABLE_ENTITY, &json!({ "error": e.to_string() })),
        Err(e) => answer(StatusCode::INTERNAL_SERVER_ERROR, &json!({ "error": e.to_string() })),
    }
}

fn answer(status: StatusCode, value: &serde_json::Value) -> Response {
    (status, [(header::CONTENT_TYPE, "application/json")], value.to_string()).into_response()
}
