"""A gimbal: how it moves (`pointing`), and the protocol that moves it (`gimbal`)."""
