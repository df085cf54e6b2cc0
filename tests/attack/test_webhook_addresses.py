"""Internet addresses that gateways translate back into a private network."""

from __future__ import annotations

import ipaddress

import pytest

from service.webhooks.addresses import AddressRefused, is_public, require_good_url

WRAPPED = (
    "fec0::1",  # site-local
    "64:ff9b::7f00:1", "64:ff9b::909:909", "64:ff9b:1::7f00:1", "64:ff9b:1:abcd::1",  # NAT64
    "::7f00:1", "::909:909",  # IPv4-compatible
    "::ffff:0:7f00:1", "::ffff:0:909:909",  # IPv4-translated
    "::ffff:127.0.0.1", "2002:7f00:1::", "2001:0:7f00:1::", "fc00::1", "fe80::1", "::1", "::",
)  # fmt: skip
PUBLIC = ("2606:4700:4700::1111", "2a00:1450::1", "9.9.9.9", "::ffff:9.9.9.9")


@pytest.mark.parametrize("address", WRAPPED)
def test_an_address_that_leads_back_is_refused(address: str) -> None:
    assert not is_public(ipaddress.ip_address(address))
    with pytest.raises(AddressRefused):
        require_good_url(f"https://[{address}]/", private=False)


@pytest.mark.parametrize("address", PUBLIC)
def test_an_address_of_the_internet_is_taken(address: str) -> None:
    assert is_public(ipaddress.ip_address(address))
