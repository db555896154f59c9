!! Where contacts are and how fast they move: s, s' and the direction of each at any time of a piece and state z = (y, y'), and how
!! these change. Times `tau` are s after the start of the piece, whose phases `begin` of the excitation forms.
module razy_hybrid_kinematics
   use razy_core_kinds, only: wp
   use razy_hybrid_excitation, only: excitation_t
   use razy_hybrid_system, only: system_t
   use razy_machine_frame, only: outward
   implicit none(type, external)
   private

   public :: kinematics_t

   type :: kinematics_t
      type(excitation_t) :: excitation
      !> s and s' of each contact, as they were looked at last (contacts).
      real(wp), allocatable :: s(:), rate(:)
      !> Direction of each contact: s' = wᵀy' + what does not depend on the state (m, contacts).
      real(wp), allocatable :: w(:, :)
      !> In a plane directions turn with the displacement, dw = turned (aroundᵀ dy) (m, contacts): s' changes by swing (aroundᵀ dy),
      !> and s'' is larger by `bend` (contacts). In a frame that a tone turns `turned` is 0, elsewhere all are.
      real(wp), allocatable :: turned(:, :), around(:, :), swing(:), bend(:)
   contains
      procedure, non_overridable :: take_directions
      procedure, non_overridable :: look_at_contact
      procedure, private, non_overridable :: look_in_plane
      procedure, private, non_overridable :: look_in_turning
      procedure, non_overridable :: look_at_contacts
      procedure, non_overridable :: slope_of_rate
      procedure, non_overridable :: second_rate
   end type kinematics_t

contains

   !> Make room for the contacts of a system, with their directions at rest.
   subroutine take_directions(self, system)
      class(kinematics_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      associate (contacts => size(system%machine%contact))
         allocate (self%s(contacts), self%rate(contacts), self%swing(contacts), self%bend(contacts), &
                   self%turned(system%m, contacts), self%around(system%m, contacts), source=0.0_wp)
         self%w = system%w
      end associate
   end subroutine take_directions

   !> s, s' and direction of contact j at z and the time looked at last.
   pure subroutine look_at_contact(self, system, j, z)
      class(kinematics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)

      if (system%curved) then
         if (allocated(system%frame(j)%across)) then
            call self%look_in_plane(system, j, z)
            return
         end if
      end if
      associate (gap => system%gap(j))
         self%s(j) = gap%value(z, self%excitation%phasor)
         self%rate(j) = gap%rate(z(system%m + 1:)) + self%excitation%rate(system%machine%tone, gap%error, 1) &
                        + system%machine%contact(j)%drive + system%machine%contact(j)%drive_rate*self%excitation%now()
      end associate
   end subroutine look_at_contact

   !> The same of a contact in a plane.
   pure subroutine look_in_plane(self, system, j, z)
      class(kinematics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)

      real(wp) :: along, around, d(2), length, n(2), rate(2), swing
      integer :: i

      if (system%frame(j)%tone > 0) then
         call self%look_in_turning(system, j, z)
         return
      end if
      d = 0.0_wp
      rate = 0.0_wp
      swing = 0.0_wp
      around = 0.0_wp
      ! In few loops, as for a frame that turns.
      associate (frame => system%frame(j), w => system%w, m => system%m)
         do i = 1, m
            d = d + [w(i, j), frame%across(i)]*z(i)
            rate = rate + [w(i, j), frame%across(i)]*z(m + i)
         end do
         d = d - frame%centre
         n = outward(d, rate)
         length = norm2(d)
         !$omp simd
         do i = 1, m
            self%w(i, j) = n(1)*w(i, j) + n(2)*frame%across(i)
            self%turned(i, j) = n(2)*w(i, j) - n(1)*frame%across(i)
            self%around(i, j) = self%turned(i, j)/max(length, tiny(1.0_wp))
         end do
         if (.not. length > 0.0_wp) self%around(:, j) = 0.0_wp
         if (system%machine%contact(j)%law%of_normal) then
            self%s(j) = 0.0_wp
            self%rate(j) = n(2)*rate(1) - n(1)*rate(2) + dot_product(frame%spin, z(m + 1:)) + system%machine%contact(j)%drive &
                           + system%machine%contact(j)%drive_rate*self%excitation%now()
            do i = 1, m
               along = self%w(i, j)
               self%w(i, j) = self%turned(i, j) + frame%spin(i)
               self%turned(i, j) = -along
            end do
         else
            self%s(j) = length
            self%rate(j) = dot_product(n, rate)
         end if
         do i = 1, m
            swing = swing + self%turned(i, j)*z(m + i)
            around = around + self%around(i, j)*z(m + i)
         end do
      end associate
      self%swing(j) = swing
      self%bend(j) = swing*around
   end subroutine look_in_plane

   !> The same of a contact whose frame turns with a tone.
   pure subroutine look_in_turning(self, system, j, z)
      class(kinematics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)

      complex(wp) :: e(0:2)
      real(wp) :: along(2), around(2), turned
      integer :: i

      along = 0.0_wp
      around = 0.0_wp
      turned = 0.0_wp
      associate (frame => system%frame(j), w => system%w, m => system%m)
         e = frame%phase*self%excitation%turning(system%machine%tone, frame%tone)
         ! In one loop: with many short ones for each ball of a bearing these are a third of a motion.
         do i = 1, m
            self%w(i, j) = e(0)%re*w(i, j) + e(0)%im*frame%across(i)
            self%around(i, j) = e(1)%re*w(i, j) + e(1)%im*frame%across(i)
            along = along + self%w(i, j)*[z(i), z(m + i)]
            around = around + self%around(i, j)*[z(i), z(m + i)]
            turned = turned + (e(2)%re*w(i, j) + e(2)%im*frame%across(i))*z(i)
         end do
      end associate
      self%swing(j) = 1.0_wp
      self%bend(j) = 2*around(2) + turned
      self%s(j) = along(1)
      self%rate(j) = along(2) + around(1)
   end subroutine look_in_turning

   !> s and s' of all contacts at (tau, z).
   pure subroutine look_at_contacts(self, system, tau, z)
      class(kinematics_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      integer :: j

      call self%excitation%look(system%machine%tone, tau)
      do j = 1, size(self%s)
         call self%look_at_contact(system, j, z)
      end do
   end subroutine look_at_contacts

   !> What s' of contact j changes by along a tangent (2m) of the state looked at last.
   pure function slope_of_rate(self, system, j, tangent) result(slope)
      class(kinematics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: tangent(:)
      real(wp) :: slope

      slope = dot_product(self%w(:, j), tangent(system%m + 1:))
      if (system%curved) slope = slope + self%swing(j)*dot_product(self%around(:, j), tangent(:system%m))
   end function slope_of_rate

   !> s'' of contact j at the acceleration a (m) and the state and time looked at last.
   pure function second_rate(self, system, j, a) result(rate)
      class(kinematics_t), intent(in) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: a(:)
      real(wp) :: rate

      rate = dot_product(self%w(:, j), a)
      if (system%curved) rate = rate + self%bend(j)
      rate = rate + system%machine%contact(j)%drive_rate + self%excitation%rate(system%machine%tone, system%gap(j)%error, 2)
   end function second_rate

end module razy_hybrid_kinematics
