#include "packets_code.h"

namespace ob {
extern const PacketCode kAvx2Packets;
const PacketCode kAvx2Packets = kCode;
} // namespace ob
