//! Who may ask: a browser on this computer that was given the address with its token. In: the head of a request. Out: what it asks for
//! below the token, or the refusal.
//!
//! A page of elsewhere can make a browser send requests here. It cannot read the token; a name of its own that it lets point to this
//! computer (DNS rebinding) shows in `Host`, its own address in `Origin`.

use super::address;
use super::http::{Answer, Head};

/// What a request must carry.
#[derive(Debug)]
pub struct Guard {
    token: String,
    port: u16,
}

/// What is asked for: the parts of the path behind the token, and the query.
#[derive(Debug, PartialEq)]
pub struct Asked {
    /// Parts of the path.
    pub parts: Vec<String>,
    /// Pairs of the query.
    pub query: Vec<(String, String)>,
}

impl Guard {
    /// With a new token: 128 bits of the system's randomness.
    pub fn new(port: u16) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes)?;
        Ok(Self { token: format!("{:032x}", u128::from_be_bytes(bytes)), port })
    }

    /// The address to open.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// What is asked for, if it may be.
    pub fn admit(&self, head: &Head) -> Result<Asked, Answer> {
        let hosts = [format!("127.0.0.1:{}", self.port), format!("localhost:{}", self.port)];
        let named: Vec<&[u8]> = head.all("host").collect();
        if !matches!(named[..], [name] if hosts.iter().any(|host| host.as_bytes() == name)) {
            return Err(Answer::text(403, "this page answers to 127.0.0.1 alone\n"));
        }
        let own = |origin: &[u8]| hosts.iter().any(|host| format!("http://{host}").as_bytes() == origin);
        if !head.all("origin").all(own) {
            return Err(Answer::text(403, "this page answers to no other page\n"));
        }
        let nothing = || Answer::text(404, "there is nothing here; open the address that feedwright serve printed\n");
        let (parts, query) = address::read(&head.target).ok_or_else(nothing)?;
        match parts.split_first() {
            Some((token, rest)) if same(token, &self.token) => Ok(Asked { parts: rest.to_vec(), query }),
            _ => Err(nothing()),
        }
    }
}

/// The same text? Takes as long wherever they first differ.
fn same(given: &str, wanted: &str) -> bool {
    let differ = given.bytes().zip(wanted.bytes()).fold(0, |differ, (a, b)| std::hint::black_box(differ | (a ^ b)));
    given.len() == wanted.len() && differ == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(guard: &Guard, target: &str, headers: &str) -> u16 {
        let text = format!("GET {target} HTTP/1.1\r\n{headers}\r\n");
        guard.admit(&Head::read(&mut text.as_bytes()).unwrap()).map_or_else(|answer| answer.status, |_| 200)
    }

    #[test]
    fn only_who_has_the_token_and_comes_from_here_is_admitted() {
        let guard = Guard::new(4711).unwrap();
        assert_ne!(guard.token, Guard::new(4711).unwrap().token);
        assert_eq!(guard.token.len(), 32);
        let at = |path: &str| format!("/{}/{path}", guard.token);
        let here = "Host: 127.0.0.1:4711\r\n";
        assert_eq!(status(&guard, &at("program/a"), here), 200);
        assert_eq!(status(&guard, &at(""), "Host: localhost:4711\r\nOrigin: http://localhost:4711\r\n"), 200);
        for headers in [
            "",
            "Host: evil.example:4711\r\n",
            "Host: 127.0.0.1\r\n",
            "Host: 127.0.0.1:4711\r\nHost: 127.0.0.1:4711\r\n",
            "Host: 127.0.0.1:4711\r\nOrigin: null\r\n",
            "Host: 127.0.0.1:4711\r\nOrigin: http://evil.example\r\n",
            "Host: 127.0.0.1:4711\r\nOrigin: https://127.0.0.1:4711\r\n",
            "Host: 127.0.0.1:4711\r\nOrigin: http://127.0.0.1:4712\r\n",
        ] {
            assert_eq!(status(&guard, &at(""), headers), 403, "{headers}");
        }
        let short = &guard.token[..31];
        for target in [
            "/".into(),
            "/program/a".into(),
            format!("/{short}/"),
            format!("/{short}x/"),
            format!("//{}/", guard.token),
        ] {
            assert_eq!(status(&guard, &target, here), 404, "{target}");
        }
    }
}
