// A network that is late: what one side says reaches the other so much later, in its order.
import { connect, createServer } from 'node:net';

/** Listens on a port of its own before `address` ("host:port"); each way takes `delayMs`. */
export async function delayed(address, delayMs) {
  const [host, port] = address.split(':');
  const sockets = new Set();
  const pass = (from, to) => {
    from.on('data', (data) => setTimeout(() => to.writable && to.write(data), delayMs));
    from.on('end', () => setTimeout(() => to.end(), delayMs));
    from.on('error', () => to.destroy());
    from.on('close', () => {
      sockets.delete(from);
      setTimeout(() => to.destroy(), 2 * delayMs);
    });
  };
  const server = createServer((near) => {
    const far = connect({ host, port: Number(port) });
    for (const socket of [near, far]) {
      socket.setNoDelay(true);
      sockets.add(socket);
    }
    pass(near, far);
    pass(far, near);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {
    http: `http://127.0.0.1:${server.address().port}`,
    close() {
      server.close();
      for (const socket of sockets) socket.destroy();
    },
  };
}
