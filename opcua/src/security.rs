//! In: certificates, a login. Out: who gets in, and how the messages are protected.
//! Frame and unit: s.

use crate::options::Options;
use async_trait::async_trait;
use opcua::crypto::SecurityPolicy;
use opcua::server::authenticator::{AuthManager, DefaultAuthenticator, Password, UserToken};
use opcua::server::{ANONYMOUS_USER_TOKEN_ID, ServerBuilder, ServerEndpoint, ServerUserToken};
use opcua::types::{Error, MessageSecurityMode, UserTokenPolicy};
use std::collections::BTreeMap;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Name of the one login among the endpoints' users.
const LOGIN: &str = "login";
/// Longest line of a login file.
const MOST_LETTERS: usize = 200;
/// A wrong password is answered after this time: guessing takes long.
const WRONG: Duration = Duration::from_secs(1);

/// Policies that are neither broken nor deprecated [opc-7, OPC 10000-7].
const POLICIES: [(SecurityPolicy, MessageSecurityMode); 5] = [
    (SecurityPolicy::Basic256Sha256, MessageSecurityMode::Sign),
    (SecurityPolicy::Basic256Sha256, MessageSecurityMode::SignAndEncrypt),
    (SecurityPolicy::Aes128Sha256RsaOaep, MessageSecurityMode::SignAndEncrypt),
    (SecurityPolicy::Aes256Sha256RsaPss, MessageSecurityMode::Sign),
    (SecurityPolicy::Aes256Sha256RsaPss, MessageSecurityMode::SignAndEncrypt),
];

/// Name and password in the lines of a login file.
///
/// # Errors
/// They are not there.
pub fn login(text: &str) -> Result<(String, String), String> {
    let mut lines = text.lines().map(|line| line.trim_end_matches('\r'));
    let (name, password) = (lines.next().unwrap_or(""), lines.next().unwrap_or(""));
    let good = |line: &str| (1..=MOST_LETTERS).contains(&line.chars().count());
    match good(name) && good(password) {
        true => Ok((name.to_owned(), password.to_owned())),
        false => Err(format!("a name and a password of 1 to {MOST_LETTERS} characters are its first two lines")),
    }
}

/// Lets in who may, and answers a wrong password late.
struct Slow(DefaultAuthenticator);

#[async_trait]
impl AuthManager for Slow {
    async fn authenticate_anonymous_token(&self, endpoint: &ServerEndpoint) -> Result<(), Error> {
        self.0.authenticate_anonymous_token(endpoint).await
    }

    async fn authenticate_username_identity_token(
        &self,
        endpoint: &ServerEndpoint,
        name: &str,
        password: &Password,
    ) -> Result<UserToken, Error> {
        let got = self.0.authenticate_username_identity_token(endpoint, name, password).await;
        if got.is_err() {
            tokio::time::sleep(WRONG).await;
        }
        got
    }

    fn user_token_policies(&self, endpoint: &ServerEndpoint) -> Vec<UserTokenPolicy> {
        self.0.user_token_policies(endpoint)
    }
}

/// Makes a folder for certificates, and one in it for the private key: only their owner reads them.
///
/// # Errors
/// Those of the disk.
pub fn make_folder(pki: &Path) -> std::io::Result<()> {
    for folder in [pki.to_owned(), pki.join("private")] {
        if !folder.is_dir() {
            std::fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
        }
    }
    Ok(())
}

/// The endpoints: open ones only for this machine and only without a login, protected ones with certificates.
pub fn secured(
    builder: ServerBuilder,
    options: &Options,
    loopback: bool,
    login: Option<(String, String)>,
    pki: &Path,
) -> ServerBuilder {
    let users = match login {
        Some(_) => vec![LOGIN.to_owned()],
        None => vec![ANONYMOUS_USER_TOKEN_ID.to_owned()],
    };
    let mut tokens = BTreeMap::new();
    let mut builder = builder.pki_dir(pki).trust_client_certs(false).create_sample_keypair(options.pki.is_some());
    if let Some((name, password)) = login {
        let token = ServerUserToken::user_pass(name, password);
        tokens.insert(LOGIN.to_owned(), token.clone());
        builder = builder.add_user_token(LOGIN, token);
    } else if loopback {
        builder = builder.add_endpoint("open", ServerEndpoint::new_none("/", &users));
    }
    if options.pki.is_some() {
        for (policy, mode) in POLICIES {
            let endpoint = ServerEndpoint::new("/", policy, mode, &users);
            builder = builder.add_endpoint(format!("{policy} {mode}"), endpoint);
        }
    }
    builder.with_authenticator(Arc::new(Slow(DefaultAuthenticator::new(tokens))))
}

#[cfg(test)]
mod tests {
    use super::login;

    #[test]
    fn a_login_has_two_lines() {
        assert_eq!(login("plc\r\nsecret word\r\n"), Ok(("plc".into(), "secret word".into())));
        for bad in ["", "plc", "plc\n\n", "\nsecret\n"] {
            assert!(login(bad).is_err(), "{bad:?}");
        }
        assert!(login(&format!("{}\nx", "n".repeat(201))).is_err());
    }
}
