// A real OpenID Connect provider (npm oidc-provider) on loopback: a firm with two people and a machine.
import { webcrypto as crypto } from 'node:crypto';
import { createServer } from 'node:http';
import Provider from 'oidc-provider';

/** By what they log in with; which roles the firm gives them. */
const PEOPLE = {
  ada: { name: 'Ada Lovelace', groups: ['engineers', 'all'] },
  bob: { name: 'Bob', groups: ['visitors'] },
};

/**
 * Signs with RS256 or ES256. `redirectUris` are changed by `allow`, as the server's port is known later than
 * the provider's.
 */
export async function startProvider({ algorithm, lifeS = 600 }) {
  const redirectUris = ['https://placeholder.example/'];
  const listener = createServer();
  await new Promise((resolve) => listener.listen(0, '127.0.0.1', resolve));
  const issuer = `http://127.0.0.1:${listener.address().port}`;
  const make = async () => {
    const provider = new Provider(issuer, {
      clients: [
        {
          client_id: 'saccade',
          redirect_uris: redirectUris,
          token_endpoint_auth_method: 'none',
          id_token_signed_response_alg: algorithm,
          response_types: ['code'],
          grant_types: ['authorization_code'],
          application_type: 'native', // http on loopback
        },
      ],
      jwks: { keys: [await makeKey(algorithm)] },
      pkce: { required: () => true, methods: ['S256'] },
      claims: { openid: ['sub'], profile: ['name', 'groups'] },
      conformIdTokenClaims: false, // the profile stands in the ID token, as many firms have it
      ttl: { IdToken: lifeS },
      cookies: { keys: ['for this test alone'] },
      async findAccount(_, id) {
        return { accountId: id, claims: () => ({ sub: id, ...PEOPLE[id] }) };
      },
    });
    return provider.callback();
  };
  let answer;
  const asked = [];
  listener.on('request', (request, response) => {
    asked.push(`${request.method} ${request.url.split('?')[0]}`);
    answer(request, response);
  });
  return {
    issuer,
    asked,
    async allow(uri) {
      redirectUris.splice(0, redirectUris.length, uri);
      answer = await make();
    },
    /** New keys, under another name: those before are gone. */
    async rotate() {
      answer = await make();
    },
    close: () => new Promise((resolve) => listener.close(resolve)),
  };
}

let made = 0;

async function makeKey(algorithm) {
  const parameters =
    algorithm === 'ES256'
      ? { name: 'ECDSA', namedCurve: 'P-256' }
      : {
          name: 'RSASSA-PKCS1-v1_5',
          modulusLength: 2048,
          publicExponent: new Uint8Array([1, 0, 1]),
          hash: 'SHA-256',
        };
  const { privateKey } = await crypto.subtle.generateKey(parameters, true, ['sign', 'verify']);
  const { kty, n, e, d, p, q, dp, dq, qi, crv, x, y } = await crypto.subtle.exportKey(
    'jwk',
    privateKey,
  );
  const whole = { kty, n, e, d, p, q, dp, dq, qi, crv, x, y, use: 'sig', kid: `key-${++made}` };
  return JSON.parse(JSON.stringify({ ...whole, alg: algorithm }));
}
