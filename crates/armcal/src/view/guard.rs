//! Who may ask: pages that this server gave out, in a browser of this machine.
//!
//! The address holds a secret that only the terminal shows, so that other users of the machine and other pages cannot
//! guess it. `Host` must name this server, so that a name that resolves to 127.0.0.1 (DNS rebinding) opens nothing. What
//! changes something must come from this origin and be JSON, which no form of another site can send.

use axum::http::header::{CONTENT_TYPE, HOST, ORIGIN};
use axum::http::{HeaderMap, Method};

/// Bytes of the secret in the address.
const SECRET_BYTES: usize = 16;

/// The rules of one server.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    hosts: [String; 2],
    /// The secret of the address, hexadecimal.
    pub secret: String,
}

impl Guard {
    /// For a server on this port, with a new secret from the operating system.
    pub fn new(port: u16) -> Result<Guard, getrandom::Error> {
        let mut bytes = [0; SECRET_BYTES];
        getrandom::fill(&mut bytes)?;
        let secret = hex::encode(bytes);
        Ok(Guard { hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")], secret })
    }

    /// Why a request is refused, if it is.
    pub fn refuses(&self, method: &Method, headers: &HeaderMap) -> Option<&'static str> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(HOST).unwrap_or_default();
        if !self.hosts.iter().any(|own| own == host) {
            return Some("this server answers only to its own address");
        }
        if *method == Method::GET {
            return None;
        }
        if text(ORIGIN) != Some(format!("http://{host}").as_str()) {
            return Some("the request comes from another page");
        }
        (text(CONTENT_TYPE) != Some("application/json")).then_some("the request is not JSON")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(host: &str, origin: &str, kind: &str) -> HeaderMap {
        let all = [(HOST, host), (ORIGIN, origin), (CONTENT_TYPE, kind)];
        all.into_iter().filter(|(_, v)| !v.is_empty()).map(|(k, v)| (k, v.parse().expect("header"))).collect()
    }

    #[test]
    fn only_this_servers_own_pages_may_ask() {
        let guard = Guard::new(4711).expect("a secret");
        assert_eq!(guard.secret.len(), 2 * SECRET_BYTES);
        let refuses = |m: Method, h, o, k| guard.refuses(&m, &headers(h, o, k)).is_some();
        let (own, json) = ("127.0.0.1:4711", "application/json");
        assert!(!refuses(Method::GET, own, "", ""));
        assert!(!refuses(Method::GET, "localhost:4711", "", ""));
        assert!(refuses(Method::GET, "evil.example:4711", "", ""), "DNS rebinding");
        assert!(refuses(Method::GET, "", "", ""));
        assert!(refuses(Method::GET, "127.0.0.1:80", "", ""));
        assert!(!refuses(Method::POST, own, "http://127.0.0.1:4711", json));
        assert!(refuses(Method::POST, own, "http://evil.example", json), "cross-site request");
        assert!(refuses(Method::POST, own, "", json));
        assert!(refuses(Method::POST, own, "http://127.0.0.1:4711", "text/plain"), "a form");
    }
}
