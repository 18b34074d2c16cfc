//! HTTP as far as a page on this computer needs it: one request a connection, with a head and a body of bounded size. In: what a
//! browser sends. Out: method, address, headers and body, or why it is refused; and the bytes of an answer.

use std::io::{self, Read, Write};

/// Largest head of a request, bytes: browsers send 1 to 2 kB, and the limits of a page in the address about as much again.
pub const MOST_HEAD: usize = 32 << 10;
/// Headers of a request at most; browsers send some 20.
const MOST_HEADERS: usize = 64;

/// The head of a request, and what came of its body with it.
#[derive(Debug)]
pub struct Head {
    /// GET, POST.
    pub method: String,
    /// Path and query as sent.
    pub target: String,
    headers: Vec<(String, Vec<u8>)>,
    rest: Vec<u8>,
}

/// Why there is no request: nobody to answer, or the status to answer with.
#[derive(Debug, PartialEq, Eq)]
pub enum Refused {
    /// The connection ended.
    Gone,
    /// The status.
    With(u16),
}

impl From<io::Error> for Refused {
    fn from(_: io::Error) -> Self {
        Refused::Gone
    }
}

impl Head {
    /// Reads up to the end of the head.
    pub fn read(stream: &mut impl Read) -> Result<Self, Refused> {
        let mut bytes = Vec::new();
        let mut part = [0; 4096];
        loop {
            let count = stream.read(&mut part)?;
            if count == 0 {
                return Err(Refused::Gone);
            }
            bytes.extend_from_slice(&part[..count]);
            if let Some(head) = Self::parse(&bytes)? {
                return Ok(head);
            }
            if bytes.len() > MOST_HEAD {
                return Err(Refused::With(431));
            }
        }
    }

    /// A head, if it is whole.
    fn parse(bytes: &[u8]) -> Result<Option<Self>, Refused> {
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let length = match request.parse(&bytes[..bytes.len().min(MOST_HEAD)]) {
            Ok(httparse::Status::Complete(length)) => length,
            Ok(httparse::Status::Partial) => return Ok(None),
            Err(httparse::Error::TooManyHeaders) => return Err(Refused::With(431)),
            Err(_) => return Err(Refused::With(400)),
        };
        Ok(Some(Self {
            method: request.method.unwrap_or_default().to_owned(),
            target: request.path.unwrap_or_default().to_owned(),
            headers: request.headers.iter().map(|h| (h.name.to_ascii_lowercase(), h.value.to_vec())).collect(),
            rest: bytes[length..].to_vec(),
        }))
    }

    /// Values of a header, by its name in small letters.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a [u8]> {
        self.headers.iter().filter(move |(known, _)| known == name).map(|(_, value)| &value[..])
    }

    /// Reads the body of at most so many bytes. Its length must be said: once, as a number, and not in chunks.
    pub fn body(&mut self, stream: &mut impl Read, most: usize) -> Result<Vec<u8>, Refused> {
        let lengths: Vec<&[u8]> = self.all("content-length").collect();
        if self.all("transfer-encoding").next().is_some() {
            return Err(Refused::With(411));
        }
        let length = match lengths[..] {
            [] => 0,
            [text] => number(text).ok_or(Refused::With(400))?,
            _ => return Err(Refused::With(400)),
        };
        if length > most {
            return Err(Refused::With(413));
        }
        let mut body = std::mem::take(&mut self.rest);
        if body.len() > length {
            return Err(Refused::With(400));
        }
        let have = body.len();
        body.resize(length, 0);
        stream.read_exact(&mut body[have..])?;
        Ok(body)
    }
}

/// Digits and nothing else.
fn number(text: &[u8]) -> Option<usize> {
    let digits = !text.is_empty() && text.iter().all(u8::is_ascii_digit);
    std::str::from_utf8(text).ok().filter(|_| digits)?.parse().ok()
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    /// Status.
    pub status: u16,
    /// Its kind, as a browser names it.
    pub kind: &'static str,
    /// Name under which a browser saves it; `None`: it is shown.
    pub save_as: Option<String>,
    /// What is sent.
    pub body: Vec<u8>,
}

impl Answer {
    /// A page.
    pub fn page(status: u16, markup: String) -> Self {
        Self { status, kind: "text/html; charset=utf-8", save_as: None, body: markup.into_bytes() }
    }

    /// A sentence.
    pub fn text(status: u16, text: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", save_as: None, body: text.into().into_bytes() }
    }

    /// A file to be saved.
    pub fn file(name: &str, bytes: Vec<u8>) -> Self {
        Self {
            status: 200,
            kind: "application/octet-stream",
            save_as: Some(super::address::encoded(name)),
            body: bytes,
        }
    }

    /// To a request that cannot be read.
    pub fn refusal(status: u16) -> Self {
        let text = match status {
            411 => "say how long the body is\n",
            413 => "this is too large\n",
            431 => "the head of the request is too large\n",
            _ => "this is no request\n",
        };
        Self::text(status, text)
    }

    /// Sends it. No other page may hold it in a frame, keep it, or learn its address; it loads nothing.
    pub fn send(&self, stream: &mut impl Write) -> io::Result<()> {
        let mut head = format!(
            "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n\
             Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
             connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'\r\n",
            self.status,
            if self.status < 400 { "OK" } else { "Refused" },
            self.kind,
            self.body.len()
        );
        if let Some(name) = &self.save_as {
            head += &format!("Content-Disposition: attachment; filename*=UTF-8''{name}\r\n");
        }
        stream.write_all((head + "\r\n").as_bytes())?;
        stream.write_all(&self.body)?;
        stream.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(text: &str) -> Result<Head, Refused> {
        Head::read(&mut text.as_bytes())
    }

    #[test]
    fn a_request_is_read_with_its_body() {
        let text = "POST /a/b?c=d HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello";
        let mut found = head(text).unwrap();
        assert_eq!((found.method.as_str(), found.target.as_str()), ("POST", "/a/b?c=d"));
        assert_eq!(found.all("host").collect::<Vec<_>>(), [b"x"]);
        assert_eq!(found.body(&mut io::empty(), 5).unwrap(), b"hello");
        assert_eq!(head(text).unwrap().body(&mut io::empty(), 4), Err(Refused::With(413)));
    }

    #[test]
    fn what_is_no_request_is_refused() {
        assert_eq!(head("GET / HT").err(), Some(Refused::Gone));
        assert_eq!(head("\x16\x03\x01\x02\r\n\r\n").err(), Some(Refused::With(400)));
        let long = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(MOST_HEAD));
        assert_eq!(head(&long).err(), Some(Refused::With(431)));
        let fits = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(MOST_HEAD - 100));
        assert!(head(&fits).is_ok());
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(MOST_HEADERS + 1));
        assert_eq!(head(&many).err(), Some(Refused::With(431)));
        for lengths in ["Content-Length: 1\r\nContent-Length: 1", "Content-Length: +1", "Content-Length: -1"] {
            let mut one = head(&format!("POST / HTTP/1.1\r\n{lengths}\r\n\r\nx")).unwrap();
            assert_eq!(one.body(&mut io::empty(), 9), Err(Refused::With(400)), "{lengths}");
        }
        let mut chunks = head("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n").unwrap();
        assert_eq!(chunks.body(&mut io::empty(), 9), Err(Refused::With(411)));
        let mut short = head("POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nx").unwrap();
        assert_eq!(short.body(&mut io::empty(), 9), Err(Refused::Gone));
    }
}
