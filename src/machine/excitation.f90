!! What acts on a machine with the tones of its excitation: its period, and the same excitation begun at another phase.
module razy_machine_excitation
   use razy_core_kinds, only: pi, wp
   use razy_core_tone, only: tone_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: acting_tones, excitation_period, period_of_loads, strobe_period, turn_tones

   !> The period is looked for up to so many periods of the first tone.
   integer, parameter :: most_turns = 1000
   !> Turns that are whole within this are whole: the rounding of a frequency over so many turns, with room.
   real(wp), parameter :: rounding = 64*most_turns*epsilon(1.0_wp)

contains

   !> Which tones have an amplitude and a frequency: of loads, of errors of contacts, of their stiffness and frames (tones).
   pure function acting_tones(machine) result(acts)
      type(machine_t), intent(in) :: machine
      logical :: acts(size(machine%tone))

      integer :: j, t

      do t = 1, size(acts)
         acts(t) = any(abs(machine%harmonic_load(:, t)) > 0.0_wp)
         do j = 1, size(machine%contact)
            acts(t) = acts(t) .or. (abs(machine%contact(j)%error(t)) > 0.0_wp .and. .not. machine%contact(j)%law%remembers) &
                      .or. machine%contact(j)%mesh_tone == t
            if (allocated(machine%contact(j)%frame)) acts(t) = acts(t) .or. machine%contact(j)%frame%tone == t
            if (allocated(machine%contact(j)%modulation)) acts(t) = acts(t) .or. abs(machine%contact(j)%modulation(t)) > 0.0_wp
         end do
         acts(t) = acts(t) .and. machine%tone(t)%omega > 0.0_wp
      end do
   end function acting_tones

   !> Common period of the tones that act on the machine, s; 0 if there is none, or one is swept or acts once.
   pure function period_of_loads(machine) result(period)
      type(machine_t), intent(in) :: machine
      real(wp) :: period

      logical :: acts(size(machine%tone))

      acts = acting_tones(machine)
      period = 0.0_wp
      if (any(acts .and. (machine%tone%is_swept() .or. .not. machine%tone%hertz > 0.0_wp))) return
      period = excitation_period(pack(machine%tone, acts))
   end function period_of_loads

   !> The period at which motions are looked at, s: that of the loads, or of what acts with an amplitude of 0, if nothing does with
   !> more, as at the end of a sweep; 0 if there is none.
   pure function strobe_period(machine) result(period)
      type(machine_t), intent(in) :: machine
      real(wp) :: period

      period = merge(period_of_loads(machine), machine%given_period, any(acting_tones(machine)))
   end function strobe_period

   !> The shortest time after which all tones are back in phase, s; 0 if there is no tone, or no such time.
   pure function excitation_period(tone) result(period)
      type(tone_t), intent(in) :: tone(:)
      real(wp) :: period

      real(wp) :: turns(size(tone))
      integer :: k

      period = 0.0_wp
      if (size(tone) == 0) return
      if (.not. all(tone%hertz > 0.0_wp)) return
      do k = 1, most_turns
         turns = k*(tone%hertz/tone(1)%hertz)
         if (any(abs(turns - anint(turns)) > rounding*max(1.0_wp, turns/k))) cycle
         period = k/tone(1)%hertz
         return
      end do
   end function excitation_period

   !> Begin the excitation F e^{iωt} of each tone at another phase, F e^{iωt} p with p of modulus 1: loads, excitation of
   !> contacts and of observables; a waveform by so many turns of its period, or, if it is there once, when it is over. `phasor`
   !> (tones).
   pure subroutine turn_tones(machine, phasor)
      type(machine_t), intent(inout) :: machine
      complex(wp), intent(in) :: phasor(:)

      integer :: j, t

      do t = 1, size(phasor)
         if (allocated(machine%tone(t)%waveform)) then
            call machine%tone(t)%waveform%renew(atan2(phasor(t)%im, phasor(t)%re)/(2*pi))
            cycle
         end if
         machine%harmonic_load(:, t) = machine%harmonic_load(:, t)*phasor(t)
         do j = 1, size(machine%contact)
            associate (contact => machine%contact(j))
               if (allocated(contact%error)) contact%error(t) = contact%error(t)*phasor(t)
               if (allocated(contact%modulation)) contact%modulation(t) = contact%modulation(t)*phasor(t)
               if (allocated(contact%frame)) then
                  if (contact%frame%tone == t) contact%frame%phase = contact%frame%phase*phasor(t)
               end if
               if (contact%mesh_tone == t) contact%mesh_phase = contact%mesh_phase + atan2(phasor(t)%im, phasor(t)%re)/(2*pi)
            end associate
         end do
         do j = 1, size(machine%observable)
            if (.not. allocated(machine%observable(j)%error)) cycle
            machine%observable(j)%error(t) = machine%observable(j)%error(t)*phasor(t)
         end do
      end do
   end subroutine turn_tones

end module razy_machine_excitation
