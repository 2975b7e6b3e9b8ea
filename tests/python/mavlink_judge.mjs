// SPDX-License-Identifier: Apache-2.0
// Frames of MAVLink 2 from standard input, decoded by node-mavlink: one line of JSON each.
//   npm install --prefix .cache/node node-mavlink@2.3.0
import { createRequire } from 'module'
import { pathToFileURL } from 'url'

const require = createRequire(pathToFileURL(process.argv[2] + '/'))
const { MavLinkPacketSplitter, MavLinkPacketParser, minimal, common } = require('node-mavlink')
const known = { ...minimal.REGISTRY, ...common.REGISTRY }
const plain = (_, value) => typeof value === 'bigint' ? value.toString() : Number.isNaN(value) ? 'nan' : value
process.stdin.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser()).on('data', packet => {
  const kind = known[packet.header.msgid]
  if (!kind) return
  const data = packet.protocol.data(packet.payload, kind)
  const fields = Object.fromEntries(kind.FIELDS.map(field => [field.source, data[field.name]]))
  console.log(JSON.stringify({ name: kind.MSG_NAME, system: packet.header.sysid, component: packet.header.compid, fields }, plain))
})
