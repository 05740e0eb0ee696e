"""A vehicle of vda5050-sdk: its VehicleClient with its OrderExecutor, made to drive.

`python sdk_vehicle.py BROKER SERIAL VERSION [SPEED]` prints "ready", then a line for each order and
instant action. It ends with standard input.
"""

import asyncio
import math
import sys

from vda5050 import VehicleClient, VehicleConfig
from vda5050.client.agv.executor import OrderExecutor
from vda5050.model.instant_actions import InstantActions
from vda5050.model.order import Node, Order

STEP_S = 0.05


class Driver(OrderExecutor):
    """Drives straight to each node. It is at rest while the vehicle is paused."""

    speed_m_s = 1.0

    async def visit_node(self, node: Node) -> None:
        target, state = node.node_position, self._publisher
        while target is not None and (place := state.agv_position) is not None:
            state.set_driving(not state.paused)
            x, y = target.x - place.x, target.y - place.y
            left_m = math.hypot(x, y)
            if left_m == 0:
                break
            share = 0.0 if state.paused else min(1.0, self.speed_m_s * STEP_S / left_m)
            to_x, to_y = place.x + share * x, place.y + share * y
            if share == 1:
                to_x, to_y = target.x, target.y
            state.update_position(x=to_x, y=to_y, theta=0.0, map_id=place.map_id)
            await asyncio.sleep(STEP_S)


async def drive(client: VehicleClient, orders: asyncio.Queue[Order], speed_m_s: float) -> None:
    while True:
        driver = Driver(client.publisher, action_delay=0.5)
        driver.speed_m_s = speed_m_s
        await driver.run(await orders.get())


async def main(broker: str, serial_number: str, version: str, speed: str = "1") -> None:
    config = VehicleConfig(
        manufacturer="m2pem",
        serial_number=serial_number,
        broker_url=broker,
        protocol_version=version,
        state_interval=0.2,
        validate_messages=version == "2.1.0",  # it has the schemas of 2.1
    )
    async with VehicleClient(config) as client:
        orders: asyncio.Queue[Order] = asyncio.Queue()
        driving = [asyncio.create_task(drive(client, orders, float(speed)))]

        @client.on_order
        def take(order: Order) -> None:
            print(f"order {order.order_update_id}", flush=True)
            orders.put_nowait(order)

        @client.on_instant_actions
        def act(message: InstantActions) -> None:
            print(f"instant {','.join(each.action_type for each in message.actions)}", flush=True)
            if any(each.action_type == "cancelOrder" for each in message.actions):
                driving.pop().cancel()
                driving.append(asyncio.create_task(drive(client, orders, float(speed))))

        client.update_position(x=0.0, y=0.0, theta=0.0, map_id="hall")
        print("ready", flush=True)
        await asyncio.to_thread(sys.stdin.read)
        driving.pop().cancel()


asyncio.run(main(*sys.argv[1:]))
