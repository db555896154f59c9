!! What is observed of a machine and felt by none of its contacts, in one closed form from the beginning of a motion to its end.
!!
!! No event changes it, so it is looked at where an observer asks for it and nowhere else. It is begun anew after times that do not
!! depend on who asks, so that its rounding stays that of a piece.
module razy_exact_beside
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, move_to, reserve, set_state, state_of
   use razy_exact_closed_form_response, only: new_response, response_t
   use razy_core_tone, only: time_to_break
   use razy_exact_modal_basis, only: dense_modes_t, modal_basis_t, new_modal_basis
   use razy_hybrid_excitation, only: excitation_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: beside_t, joined

   type :: beside_t
      type(modal_basis_t) :: basis
      type(response_t) :: response
      type(excitation_t), private :: excitation
      !> Amplitudes where it was begun, at `time`, s, and where it was looked at last (one array for the reason told at
      !> `free_motions_t`); how long a stretch may be, and is, s.
      type(amplitudes_t), private :: at(2)
      real(wp), private :: time = 0.0_wp, stretch = 0.0_wp, length = 0.0_wp
      integer, private :: version = 0, structure = 0
   contains
      procedure :: begin
      procedure :: find_state
   end type beside_t

   !> A stretch is no longer than this angle of the fastest exponent, and no term grows by more than the exponential of this in it.
   real(wp), parameter :: longest_angle = 1.0e3_wp, longest_growth = 50.0_wp
   !> What is slower stands, 1/s.
   real(wp), parameter :: slowest = 1.0e-200_wp

contains

   !> A motion of the system begins at `time`, s; `info` is not 0 where there are no eigenmodes.
   subroutine begin(self, system, time, info)
      class(beside_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time
      integer, intent(out) :: info

      real(wp), allocatable :: free(:, :)
      logical :: acts(size(system%gap))
      integer :: rigid

      if (self%structure /= system%structure) then
         self%structure = system%structure
         acts = .false.
         call system%free_beside%in_state(acts, acts, free, rigid)
         call new_modal_basis(self%basis, system%beside%stiffness, system%beside%damping, free, rigid)
      end if
      info = self%basis%info
      if (info /= 0) return
      if (self%version /= system%version) then
         self%version = system%version
         call new_response(self%response, self%basis, .false., system%load_beside, system%harmonic_beside, system%turning, &
                           system%slope)
         call reserve(self%at(1), self%response)
         call reserve(self%at(2), self%response)
         self%stretch = longest_angle/max(self%response%turning, self%response%fastest, system%fastest, slowest)
         if (self%response%growing) then
            self%stretch = min(self%stretch, longest_growth/maxval(real(self%response%exponent)))
         end if
      end if
      call begin_stretch(self, system, time, system%first_beside())
   end subroutine begin

   subroutine begin_stretch(self, system, time, z)
      type(beside_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time, z(:)

      self%time = time
      self%length = min(self%stretch, time_to_break(system%machine%tone, time, 0.0_wp))
      call self%excitation%begin(system%machine%tone, time, 0.0_wp)
      call set_state(self%at(1), self%response, z, self%excitation%start)
   end subroutine begin_stretch

   !> The state z at `time + time_low`, s, which is not before one that was asked for.
   subroutine find_state(self, system, time, time_low, z)
      class(beside_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: time, time_low
      real(wp), intent(out) :: z(:)

      ! A piece that begins at a break, to rounding, is one of the loads that follow it.
      do while (time - self%time >= self%length - 8*epsilon(1.0_wp)*abs(time))
         call move_to(self%at(1), self%response, self%length, self%at(2))
         call state_of(self%at(2), self%response, z)
         call begin_stretch(self, system, self%time + self%length, z)
      end do
      call move_to(self%at(1), self%response, (time - self%time) + time_low, self%at(2))
      call state_of(self%at(2), self%response, z)
   end subroutine find_state

   !> The modes of two machines that nothing couples, whose coordinates follow each other.
   pure function joined(first, second) result(both)
      type(modal_basis_t), intent(in) :: first, second
      type(modal_basis_t) :: both

      integer :: i, r

      r = size(first%rigid, 2)
      both%m = first%m + second%m
      both%lambda = [first%lambda, second%lambda]
      associate (a => first%m, m => both%m, n => size(first%lambda))
         allocate (both%to_term(size(both%lambda), 2*m), both%from_term(2*m, size(both%lambda)), source=(0.0_wp, 0.0_wp))
         both%to_term(:n, :a) = first%to_term(:, :a)
         both%to_term(:n, m + 1:m + a) = first%to_term(:, a + 1:)
         both%to_term(n + 1:, a + 1:m) = second%to_term(:, :second%m)
         both%to_term(n + 1:, m + a + 1:) = second%to_term(:, second%m + 1:)
         both%from_term(:a, :n) = first%from_term(:a, :)
         both%from_term(m + 1:m + a, :n) = first%from_term(a + 1:, :)
         both%from_term(a + 1:m, n + 1:) = second%from_term(:second%m, :)
         both%from_term(m + a + 1:, n + 1:) = second%from_term(second%m + 1:, :)
         allocate (both%rigid(m, r + size(second%rigid, 2)), source=0.0_wp)
         both%rigid(:a, :r) = first%rigid
         both%rigid(a + 1:, r + 1:) = second%rigid
         allocate (both%dense(size(first%dense) + size(second%dense)))
         do i = 1, size(first%dense)
            call place(first%dense(i), 0, m, both%dense(i))
         end do
         do i = 1, size(second%dense)
            call place(second%dense(i), a, m, both%dense(size(first%dense) + i))
         end do
      end associate
      both%fastest = max(first%fastest, second%fastest)
      both%stiff = first%stiff .or. second%stiff
   end function joined

   !> Modes that are kept together, whose coordinates come after `before` others of `m`.
   pure subroutine place(modes, before, m, placed)
      type(dense_modes_t), intent(in) :: modes
      integer, intent(in) :: before, m
      type(dense_modes_t), intent(inout) :: placed

      placed = modes
      deallocate (placed%phi)
      allocate (placed%phi(m, size(modes%phi, 2)), source=0.0_wp)
      placed%phi(before + 1:before + size(modes%phi, 1), :) = modes%phi
   end subroutine place

end module razy_exact_beside
