#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# acm.sh - in the virtual machine: makes a USB serial port with both ends in it: /dev/ttyACM0 (opened by the driver) and
# /dev/ttyGS0 (where an emulated motor controller answers). Needs MODULES=$'dummy_hcd\nlibcomposite\nusb_f_acm\ncdc_acm'.
# Unplug: echo "" > /sys/kernel/config/usb_gadget/g/UDC      Plug in: echo dummy_udc.0 > the same file
set -e
mount -t configfs none /sys/kernel/config 2>/dev/null || true
cd /sys/kernel/config/usb_gadget && mkdir -p g && cd g
echo 0x1d6b > idVendor; echo 0x0104 > idProduct
mkdir -p strings/0x409 configs/c.1 functions/acm.0
echo twocone > strings/0x409/manufacturer; echo motor > strings/0x409/product; echo 1 > strings/0x409/serialnumber
ln -s functions/acm.0 configs/c.1/
echo dummy_udc.0 > UDC; udevadm settle; sleep 1
stty -F /dev/ttyGS0 raw -echo
ls -l /dev/ttyACM0 /dev/ttyGS0 /dev/serial/by-id
