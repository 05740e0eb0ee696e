from tests.postgres_server import postgres, postgres_url

__all__ = ["postgres", "postgres_url"]
